// What the planner's own steps say in SUPPORT_PLAN.
#pragma once

#include <Eigen/Geometry>

#include "components/step_planner/stepping/footwork.h"
#include "poise/support_plan_t.hpp"

namespace poise {

/// Fills stepping, step_*, foothold* and touch_down_time at `time`, s, and walk_velocity; soles in
/// the world. Without steps the last step's foot and foothold stay.
void ReportStepping(const stepping::StepStatus& status, const stepping::WalkCommand& command,
                    double time, const robot::FootArray<Eigen::Isometry3d>& sole,
                    support_plan_t* plan);

}  // namespace poise
