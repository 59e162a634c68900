// What the step planner orders: SUPPORT_PLAN.
#pragma once

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

/// All but the status: contacts, transition and references; the robot as it is while it has no task
/// but gravity.
void FillSupportPlan(const SupportView& view, const EstimatedPose& estimate,
                     const References& references, support_plan_t* plan);

}  // namespace poise
