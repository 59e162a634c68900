#include "logging/metrics/planner_steps.h"

namespace poise::logging {

const char* StepReason(int8_t reason) {
  switch (reason) {
    case support_plan_t::REASON_PERSISTENT:
      return "the capture point stays beyond the soles";
    case support_plan_t::REASON_OUTSIDE:
      return "the capture point is farther beyond the soles than balancing brings back";
    case support_plan_t::REASON_LINGERING:
      return "the capture point lingers at the soles' edge and comes out";
    case support_plan_t::REASON_AGAIN:
      return "the step before did not catch the capture point";
    case support_plan_t::REASON_WALK:
      return "the robot walks";
    case support_plan_t::REASON_TOGETHER:
      return "the feet are put side by side";
    default:
      return "no reason";
  }
}

std::vector<PlannerStep> PlannerSteps(const RunRecord& run) {
  std::vector<PlannerStep> steps;
  const auto position = [](const support_plan_t& plan, size_t foot) {
    return Eigen::Vector2d(plan.foot_pose[foot].position[0], plan.foot_pose[foot].position[1]);
  };
  bool known = false;
  int32_t count = 0;
  int8_t stepping = support_plan_t::STEPPING_NONE;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const support_plan_t* const plan = run.plan.at(tick);
    if (plan == nullptr) continue;
    const auto foot = static_cast<size_t>(plan->step_foot);
    const bool named = plan->step_foot >= 0 && plan->step_foot < plan->num_feet;
    const Eigen::Vector2d foothold(plan->foothold[0], plan->foothold[1]);
    if (known && named && plan->num_steps > count) {
      PlannerStep step;
      step.foot = foot;
      step.reason = plan->step_reason;
      step.begin = tick;
      step.planned_time = plan->touch_down_time;
      step.from = position(*plan, foot);
      step.planned = foothold;
      steps.push_back(step);
    }
    const bool lands =
        known && stepping != plan->stepping && plan->stepping == support_plan_t::STEPPING_LOADING;
    if (lands && named && !steps.empty() && !steps.back().landing && steps.back().foot == foot) {
      PlannerStep& step = steps.back();
      step.landing = tick;
      step.landed = position(*plan, foot);
      step.foothold = foothold;
      step.margin = plan->capture_margin;
      step.planned_margin = plan->foothold_margin;
    }
    known = true;
    count = plan->num_steps;
    stepping = plan->stepping;
  }
  return steps;
}

}  // namespace poise::logging
