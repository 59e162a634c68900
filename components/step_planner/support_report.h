// What the step planner says in SUPPORT_PLAN of phases, feet, references and capture point.
#pragma once

#include <Eigen/Geometry>

#include "components/balance/capture_point.h"
#include "components/balance/convex_polygon.h"
#include "components/framework/tick_time.h"
#include "components/robot/dynamics.h"
#include "components/step_planner/contact/landing.h"
#include "components/step_planner/phase_schedule.h"
#include "components/step_planner/reference_generator.h"
#include "components/step_planner/stepping/footwork.h"
#include "poise/support_plan_t.hpp"

namespace poise {

/// Who leads the feet in a tick, and where they are.
struct SupportView {
  const PhaseSchedule& schedule;
  bool held;                          ///< the schedule
  const stepping::StepOutput* steps;  ///< nullptr: the schedule leads
  robot::FootArray<bool> in_contact;
  const robot::FootArray<Landing>& landing;
};

/// Phase, what it waits for, and transition; `time`, s.
void ReportPhase(const SupportView& view, double time, support_plan_t* plan);

/// Contacts of now and next, states and poses.
void ReportFeet(const SupportView& view, const robot::RobotData& data, support_plan_t* plan);

/// COM, body and feet with their references; where those are not `controlled`, the robot as it is.
void ReportReferences(const SupportView& view, const robot::RobotData& data,
                      const EstimatedPose& estimate, const References& references, bool controlled,
                      support_plan_t* plan);

/// Capture point and the step that it asks for; `soles` in `frame_o`, at least a corner.
void ReportCapture(double time, const Eigen::Isometry3d& frame_o,
                   const balance::ConvexPolygon& soles, const balance::CapturePoint& pendulum,
                   HeldCondition* step_needed, support_plan_t* plan);

}  // namespace poise
