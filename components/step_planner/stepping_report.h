// What the planner's own steps say in SUPPORT_PLAN.
#pragma once

#include <Eigen/Geometry>

#include "components/step_planner/stepping/quasi_static_walk.h"
#include "components/step_planner/stepping/recovery.h"
#include "poise/support_plan_t.hpp"

namespace poise {

/// STEPPING_*.
int8_t SteppingCode(stepping::Stage stage);
/// REASON_*.
int8_t ReasonCode(stepping::StepReason reason);

/// Fills stepping, step_*, num_steps, foothold* and touch_down_time at `time`, s; soles in the
/// world, right first.
void ReportStepping(const stepping::Recovery& recovery, double time,
                    const robot::FootArray<Eigen::Isometry3d>& sole, support_plan_t* plan);

/// The same of walking, and walk_velocity.
void ReportWalking(const stepping::QuasiStaticWalk& walk, double time,
                   const robot::FootArray<Eigen::Isometry3d>& sole, support_plan_t* plan);

/// What is walked, into `plan`.
void ReportCommand(const stepping::WalkCommand& command, support_plan_t* plan);

}  // namespace poise
