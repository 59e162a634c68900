// What the step planner reports: PLANNER_STATUS.
#pragma once

#include <Eigen/Geometry>

#include "components/balance/capture_point.h"
#include "components/balance/convex_polygon.h"
#include "components/framework/tick_time.h"
#include "components/robot/dynamics.h"
#include "components/step_planner/stepping/footwork.h"
#include "components/step_planner/support_plan_message.h"
#include "poise/planner_status_t.hpp"

namespace poise {

/// The phase, what it waits for, and what follows when; `time`, s.
void ReportPhase(const SupportView& view, double time, planner_status_t* status);

/// The COM, and the feet's states, poses and next contacts.
void ReportRobot(const SupportView& view, const robot::RobotData& data, planner_status_t* status);

/// The planner's own step at `time`, s, and walk_velocity; soles in the world. Without a step the
/// last step's foot and foothold stay.
void ReportStepping(const stepping::StepStatus& own, const stepping::WalkCommand& command,
                    double time, const robot::FootArray<Eigen::Isometry3d>& sole,
                    planner_status_t* status);

/// Whether the capture point has left what the soles can stop, and the step that it then asks for;
/// `soles` in `frame_o`, at least a corner.
void MonitorCapture(double time, const Eigen::Isometry3d& frame_o,
                    const balance::ConvexPolygon& soles, const balance::CapturePoint& pendulum,
                    HeldCondition* step_needed, planner_status_t* status);

}  // namespace poise
