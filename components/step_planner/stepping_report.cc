#include "components/step_planner/stepping_report.h"

#include <algorithm>

#include "components/messages/conversions.h"

namespace poise {

int8_t SteppingCode(stepping::Stage stage) {
  switch (stage) {
    case stepping::Stage::kUnloading:
      return support_plan_t::STEPPING_UNLOADING;
    case stepping::Stage::kSwinging:
      return support_plan_t::STEPPING_SWINGING;
    case stepping::Stage::kLoading:
      return support_plan_t::STEPPING_LOADING;
    case stepping::Stage::kCatching:
      return support_plan_t::STEPPING_CATCHING;
    case stepping::Stage::kIdle:
      break;
  }
  return support_plan_t::STEPPING_NONE;
}

int8_t ReasonCode(stepping::StepReason reason) {
  switch (reason) {
    case stepping::StepReason::kPersistent:
      return support_plan_t::REASON_PERSISTENT;
    case stepping::StepReason::kSure:
      return support_plan_t::REASON_SURE;
    case stepping::StepReason::kDeadline:
      return support_plan_t::REASON_DEADLINE;
    case stepping::StepReason::kAgain:
      return support_plan_t::REASON_AGAIN;
    case stepping::StepReason::kWalk:
      return support_plan_t::REASON_WALK;
    case stepping::StepReason::kTogether:
      return support_plan_t::REASON_TOGETHER;
    case stepping::StepReason::kNone:
      break;
  }
  return support_plan_t::REASON_NONE;
}

void ReportStepping(const stepping::Recovery& recovery, double time,
                    const std::array<Eigen::Isometry3d, 2>& sole, support_plan_t* plan) {
  plan->stepping = SteppingCode(recovery.stage());
  plan->num_steps = recovery.num_steps();
  if (recovery.num_steps() == 0) return;
  const bool under_way = recovery.stage() == stepping::Stage::kUnloading ||
                         recovery.stage() == stepping::Stage::kSwinging;
  const stepping::StepPlan& step = recovery.plan();
  const double ground = sole[step.foot == robot::kRightFoot ? 1 : 0].translation().z();
  const Eigen::Vector2d& cop = recovery.output().cop;
  plan->step_reason = ReasonCode(recovery.reason());
  plan->step_foot = static_cast<int8_t>(step.foot);
  SetVector3({step.foothold.x(), step.foothold.y(), ground}, plan->foothold);
  SetVector3({cop.x(), cop.y(), ground}, plan->cop_reference);
  plan->touch_down_time = under_way ? std::max(0.0, recovery.touch_down() - time) : 0;
  plan->foothold_margin = step.margin;
}

}  // namespace poise
