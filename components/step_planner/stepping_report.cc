#include "components/step_planner/stepping_report.h"

#include <algorithm>

#include "components/messages/conversions.h"

namespace poise {

void ReportStepping(const stepping::StepStatus& status, const stepping::WalkCommand& command,
                    double time, const robot::FootArray<Eigen::Isometry3d>& sole,
                    support_plan_t* plan) {
  plan->stepping = status.stage;
  plan->touch_down_time = status.touch_down < 0 ? 0 : std::max(0.0, status.touch_down - time);
  SetVector3({command.velocity.x(), command.velocity.y(), command.turn_rate}, plan->walk_velocity);
  if (status.stage == support_plan_t::STEPPING_NONE) return;
  const double ground = sole[Other(status.foot)].translation().z();
  plan->step_reason = static_cast<int8_t>(status.reason);
  plan->step_foot = static_cast<int8_t>(status.foot);
  SetVector3({status.foothold.x(), status.foothold.y(), ground}, plan->foothold);
  plan->foothold_margin = status.margin;
}

}  // namespace poise
