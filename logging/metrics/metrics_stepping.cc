#include <algorithm>
#include <cmath>
#include <vector>

#include "components/messages/conversions.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"
#include "logging/metrics/true_contacts.h"

namespace poise::logging {
namespace {

/// Ticks in which a foot is on its way, a step each.
std::vector<Interval> Steps(const RunRecord& run) {
  return Intervals(run, OfTick(run.planner, [](const planner_status_t& planner) {
                     return planner.stepping == planner_status_t::STEPPING_UNLOADING ||
                            planner.stepping == planner_status_t::STEPPING_SWINGING;
                   }));
}

// Share of the largest force from which a push counts: its measurement is noisy.
constexpr double kPushShare = 0.05;

/// The first tick that was pushed in.
std::optional<int64_t> PushBegin(const RunRecord& run) {
  const Answer largest = Maximum(run, OfTick(run.push, [](const external_push_t& push) {
                                   return GetVector3(push.force).norm();
                                 }));
  if (!largest) return {};
  for (const auto& [tick, push] : Messages(run.push, run.first_tick, run.num_ticks)) {
    if (GetVector3(push->force).norm() > kPushShare * *largest) return tick;
  }
  return {};
}

/// s from the push's begin to what `of` tells of the first step.
template <class F>
Compute FirstStep(F of) {
  return [of](const RunRecord& run) -> Answer {
    const std::vector<Interval> steps = Steps(run);
    const std::optional<int64_t> push = PushBegin(run);
    const std::optional<int64_t> tick = steps.empty() ? std::nullopt : of(steps.front());
    if (!push || !tick || *tick < *push) return {};
    return run.duration(*tick - *push);
  };
}

Answer StepCount(const RunRecord& run) {
  if (run.truth.empty()) return {};
  return static_cast<double>(std::ranges::count_if(
      TrueSteps(run), [&](const TrueStep& step) { return step.lifted >= run.first_tick; }));
}

/// mm.
Answer LandingHeight(const RunRecord& run) {
  Answer largest;
  for (const TrueStep& step : TrueSteps(run)) {
    const ground_truth_t* const truth = run.truth.at(step.landed);
    if (step.lifted < run.first_tick || truth == nullptr) continue;
    const double height =
        truth->foot_pose[step.foot].position[2] - truth->foot_pose[1 - step.foot].position[2];
    largest = std::max(largest, Answer(kMilli * std::abs(height)));
  }
  return largest;
}

Answer LongestStep(const RunRecord& run) {
  Answer longest;
  for (const Interval& step : Steps(run)) {
    if (step.end) longest = std::max(longest, Answer(run.duration(*step.end - step.begin)));
  }
  return longest;
}

/// mm.
Answer FootholdMargin(const RunRecord& run) {
  Answer least;
  for (const Interval& step : Steps(run)) {
    const planner_status_t* planner = step.end ? run.planner.at(*step.end) : nullptr;
    if (planner == nullptr) continue;
    const double margin = kMilli * planner->foothold_margin;
    least = std::min(least.value_or(margin), margin);
  }
  return least;
}

}  // namespace

void AddStepping(MetricList* list) {
  list->Add("steps", "",
            "feet that left the ground and carried elsewhere, or in turn on the spot, in truth",
            StepCount);
  list->Add("landing_height_max", "mm",
            "true height above or below the other sole at which a foot came down, largest",
            LandingHeight);
  list->Add("step_decision", "s", "from the push's begin to the decision for a step",
            FirstStep([](const Interval& step) { return std::optional(step.begin); }));
  list->Add("step_touch_down", "s", "from the push's begin to the first step's touch-down",
            FirstStep([](const Interval& step) { return step.end; }));
  list->Add("step_duration", "s", "the longest from a step's decision to its touch-down",
            LongestStep);
  list->Add("foothold_margin_min", "mm",
            "capture point inside the soles (negative: outside) as a foot touches down, planned, "
            "smallest",
            FootholdMargin);
}

}  // namespace poise::logging
