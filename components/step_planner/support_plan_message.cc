#include "components/step_planner/support_plan_message.h"

#include "components/messages/conversions.h"
#include "components/messages/motion.h"

namespace poise {
namespace {

using robot::Foot;
using robot::kFeet;

void FillTransition(const SupportView& view, support_plan_t* plan) {
  support_plan_t& out = *plan;
  if (view.held) {
    const stepping::StepOutput* steps = view.steps;
    const TransitionKind kind = steps != nullptr ? steps->transition : TransitionKind::kNone;
    const bool none = kind == TransitionKind::kNone;
    out.transition = static_cast<int8_t>(kind);
    out.transition_foot = none ? int8_t{-1} : static_cast<int8_t>(steps->foot);
    out.transition_progress = none ? 0 : steps->progress;
    return;
  }
  const ScheduleState& schedule = view.schedule.state();
  out.transition = static_cast<int8_t>(schedule.transition);
  out.transition_foot =
      schedule.transition_foot ? static_cast<int8_t>(*schedule.transition_foot) : int8_t{-1};
  out.transition_progress = schedule.progress;
}

}  // namespace

void FillSupportPlan(const SupportView& view, const EstimatedPose& estimate,
                     const References& references, support_plan_t* plan) {
  support_plan_t& out = *plan;
  const bool controlled = !view.schedule.phase().gravity_compensation();
  out.gravity_compensation = controlled ? 0 : 1;
  FillTransition(view, plan);
  SetMotion(controlled ? references.com : PointMotion{.position = estimate.com},
            &out.com_reference);
  const stepping::StepOutput* const steps = controlled ? view.steps : nullptr;
  out.com_follows =
      steps != nullptr ? support_plan_t::FOLLOWS_COP : support_plan_t::FOLLOWS_REFERENCE;
  if (steps != nullptr) SetVector3(steps->cop_reference, out.cop_reference);
  SetMotion(controlled ? references.body : RotationMotion{.rotation = estimate.body_rotation},
            &out.body_reference);
  for (const Foot f : kFeet) {
    out.in_contact[Index(f)] = view.in_contact[f] ? 1 : 0;
    const bool moves = controlled && !view.in_contact[f];
    const Eigen::Isometry3d& sole = estimate.sole[f];
    SetMotion(moves ? references.foot[f] : PointMotion{.position = sole.translation()},
              &out.foot_reference[Index(f)]);
    SetMotion(moves ? references.foot_rotation[f] : RotationMotion{.rotation = sole.linear()},
              &out.foot_rotation_reference[Index(f)]);
  }
}

}  // namespace poise
