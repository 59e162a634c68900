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
  double largest = 0;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    if (const external_push_t* push = run.push.at(tick)) {
      largest = std::max(largest, GetVector3(push->force).norm());
    }
  }
  if (!(largest > 0)) return {};
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    const external_push_t* push = run.push.at(tick);
    if (push != nullptr && GetVector3(push->force).norm() > kPushShare * largest) return tick;
  }
  return {};
}

Answer FromPush(const RunRecord& run, std::optional<int64_t> tick) {
  const std::optional<int64_t> push = PushBegin(run);
  if (!push || !tick || *tick < *push) return {};
  return run.duration(*tick - *push);
}

std::optional<Interval> FirstStep(const RunRecord& run) {
  const std::vector<Interval> steps = Steps(run);
  if (steps.empty()) return {};
  return steps.front();
}

}  // namespace

void AddStepping(MetricList* list) {
  list->push_back({"steps", "", "feet that left the ground and carried again, in truth",
                   [](const RunRecord& run) -> Answer {
                     if (run.truth.empty()) return {};
                     const std::vector<TrueStep> steps = TrueSteps(run);
                     return static_cast<double>(std::ranges::count_if(
                         steps, [&](const TrueStep& s) { return s.lifted >= run.first_tick; }));
                   }});
  list->push_back({"landing_height_max", "mm",
                   "true height above or below the other sole at which a foot came down, largest",
                   [](const RunRecord& run) -> Answer {
                     Answer largest;
                     for (const TrueStep& step : TrueSteps(run)) {
                       const ground_truth_t* const truth = run.truth.at(step.landed);
                       if (step.lifted < run.first_tick || truth == nullptr) continue;
                       const double height = truth->foot_pose[step.foot].position[2] -
                                             truth->foot_pose[1 - step.foot].position[2];
                       largest = std::max(largest.value_or(0), kMilli * std::abs(height));
                     }
                     return largest;
                   }});
  list->push_back({"step_decision", "s", "from the push's begin to the decision for a step",
                   [](const RunRecord& run) -> Answer {
                     const std::optional<Interval> step = FirstStep(run);
                     return step ? FromPush(run, step->begin) : Answer();
                   }});
  list->push_back({"step_touch_down", "s", "from the push's begin to the first step's touch-down",
                   [](const RunRecord& run) -> Answer {
                     const std::optional<Interval> step = FirstStep(run);
                     return step ? FromPush(run, step->end) : Answer();
                   }});
  list->push_back({"step_duration", "s", "the longest from a step's decision to its touch-down",
                   [](const RunRecord& run) -> Answer {
                     Answer longest;
                     for (const Interval& step : Steps(run)) {
                       if (!step.end) continue;
                       longest =
                           std::max(longest.value_or(0), run.duration(*step.end - step.begin));
                     }
                     return longest;
                   }});
  list->push_back({"foothold_margin_min", "mm",
                   "capture point inside the soles (negative: outside) as a foot touches down, "
                   "planned, smallest",
                   [](const RunRecord& run) -> Answer {
                     Answer least;
                     for (const Interval& step : Steps(run)) {
                       const planner_status_t* planner =
                           step.end ? run.planner.at(*step.end) : nullptr;
                       if (planner == nullptr) continue;
                       const double margin = kMilli * planner->foothold_margin;
                       least = least ? std::min(*least, margin) : margin;
                     }
                     return least;
                   }});
}

}  // namespace poise::logging
