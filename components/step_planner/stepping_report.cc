#include "components/step_planner/stepping_report.h"

#include <algorithm>

#include "components/messages/conversions.h"

namespace poise {

namespace {

int8_t StageCode(stepping::Stage stage) {
  switch (stage) {
    case stepping::Stage::kStanding:
      return support_plan_t::STEPPING_NONE;
    case stepping::Stage::kUnloading:
      return support_plan_t::STEPPING_UNLOADING;
    case stepping::Stage::kSwinging:
    case stepping::Stage::kTouching:
      return support_plan_t::STEPPING_SWINGING;
    case stepping::Stage::kLoading:
      return support_plan_t::STEPPING_LOADING;
    case stepping::Stage::kShifting:
    case stepping::Stage::kCatching:
      break;
  }
  return support_plan_t::STEPPING_CATCHING;
}

}  // namespace

void ReportStepping(const stepping::StepStatus& status, const stepping::WalkCommand& command,
                    double time, const robot::FootArray<Eigen::Isometry3d>& sole,
                    support_plan_t* plan) {
  const stepping::Footstep& step = status.step;
  plan->stepping = StageCode(status.stage);
  plan->touch_down_time = status.under_way ? std::max(0.0, step.touch_down - time) : 0;
  SetVector3({command.velocity.x(), command.velocity.y(), command.turn_rate}, plan->walk_velocity);
  if (status.stage == stepping::Stage::kStanding) return;
  const double ground = sole[Other(step.foot)].translation().z();
  plan->step_reason = static_cast<int8_t>(status.reason);
  plan->step_foot = static_cast<int8_t>(step.foot);
  SetVector3({step.at.position.x(), step.at.position.y(), ground}, plan->foothold);
  plan->foothold_margin = status.margin;
}

}  // namespace poise
