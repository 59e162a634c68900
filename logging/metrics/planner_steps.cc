#include "logging/metrics/planner_steps.h"

#include <map>

#include "logging/metrics/analysis.h"

namespace poise::logging {

const char* StepReason(int8_t reason) {
  using Status = planner_status_t;
  static const std::map<int8_t, const char*> words = {
      {Status::REASON_PERSISTENT, "the capture point stays beyond the soles"},
      {Status::REASON_OUTSIDE,
       "the capture point is farther beyond the soles than balancing brings back"},
      {Status::REASON_LINGERING, "the capture point lingers at the soles' edge and comes out"},
      {Status::REASON_AGAIN, "the step before did not catch the capture point"},
      {Status::REASON_WALK, "the robot walks"},
      {Status::REASON_TOGETHER, "the feet are put side by side"}};
  const auto found = words.find(reason);
  return found == words.end() ? "no reason" : found->second;
}

std::vector<PlannerStep> PlannerSteps(const RunRecord& run) {
  std::vector<PlannerStep> steps;
  const auto position = [](const planner_status_t& planner, size_t foot) {
    return Eigen::Vector2d(planner.foot_pose[foot].position[0],
                           planner.foot_pose[foot].position[1]);
  };
  bool known = false;
  int32_t count = 0;
  int8_t stepping = planner_status_t::STEPPING_NONE;
  for (const auto& [tick, planner] : Messages(run.planner, 0, run.num_ticks)) {
    const auto foot = static_cast<size_t>(planner->step_foot);
    const bool named = planner->step_foot >= 0 && planner->step_foot < planner->num_feet;
    const Eigen::Vector2d foothold(planner->foothold[0], planner->foothold[1]);
    if (known && named && planner->num_steps > count) {
      PlannerStep step;
      step.foot = foot;
      step.reason = planner->step_reason;
      step.begin = tick;
      step.planned_time = planner->touch_down_time;
      step.from = position(*planner, foot);
      step.planned = foothold;
      steps.push_back(step);
    }
    const bool lands = known && stepping != planner->stepping &&
                       planner->stepping == planner_status_t::STEPPING_LOADING;
    if (lands && named && !steps.empty() && !steps.back().landing && steps.back().foot == foot) {
      PlannerStep& step = steps.back();
      step.landing = tick;
      step.landed = position(*planner, foot);
      step.foothold = foothold;
      step.margin = planner->capture_margin;
      step.planned_margin = planner->foothold_margin;
    }
    known = true;
    count = planner->num_steps;
    stepping = planner->stepping;
  }
  return steps;
}

}  // namespace poise::logging
