#include <cmath>
#include <optional>
#include <vector>

#include "fmt/format.h"
#include "logging/metrics/contact_history.h"
#include "logging/metrics/metric_groups.h"
#include "logging/metrics/true_contacts.h"

namespace poise::logging {
namespace {

void AddIntervals(MetricList* list) {
  const auto add = [&](const char* name, const char* unit, const char* text, auto field) {
    list->push_back({name, unit, text, [field](const RunRecord& run) -> Answer {
                       const auto balancing = Balancing(run);
                       if (!balancing) return {};
                       return field(*balancing);
                     }});
  };
  const auto if_on = [](auto field) {
    return [field](const BalancingIntervals& b) -> Answer {
      if (b.activations == 0) return {};
      return b.*field;
    };
  };
  add("balancing_first", "s", "balancing first on", if_on(&BalancingIntervals::first));
  add("balancing_last", "s", "balancing last on", if_on(&BalancingIntervals::last));
  add("balancing_active", "s", "time with balancing on, in sum",
      [](const BalancingIntervals& b) -> Answer { return b.active; });
  add("balancing_activations", "", "times that balancing was switched on",
      [](const BalancingIntervals& b) -> Answer { return b.activations; });
}

void AddCop(MetricList* list) {
  const auto add = [&](const char* name, const char* text, auto value) {
    for (int axis = 0; axis < 2; ++axis) {
      list->push_back({fmt::format("{}_{}", name, kAxis[axis]), "mm",
                       fmt::format("{}, {} in frame O", text, kAxis[axis]),
                       [axis, value](const RunRecord& run) {
                         return Scaled(Maximum(run, [&](int64_t t) { return value(run, t, axis); }),
                                       kMilli);
                       }});
    }
  };
  using Field = double(balance_torque_t::*)[2];
  const auto of = [](Field field) {
    return [field](const RunRecord& run, int64_t t, int axis) -> Answer {
      const balance_torque_t* balance = run.balance.at(t);
      if (balance == nullptr) return {};
      return std::abs((balance->*field)[axis]);
    };
  };
  add("cop_task_max", "largest CoP that the task torque alone would give",
      of(&balance_torque_t::cop_task));
  const auto size = [](const auto& cop, int axis) -> Answer {
    if (!cop) return {};
    return std::abs((*cop)(axis));
  };
  add("cop_max", "largest CoP of the computed resultant",
      [size](const RunRecord& run, int64_t t, int axis) {
        return size(ComputedCop(run, t), axis);
      });
  add("cop_limit", "limit of the CoP, (37), (38)", of(&balance_torque_t::cop_limit));
  add("cop_excess", "largest computed CoP beyond its limit (negative: inside)",
      [](const RunRecord& run, int64_t t, int axis) -> Answer {
        const balance_torque_t* balance = run.balance.at(t);
        if (balance == nullptr) return {};
        return std::abs(balance->cop[axis]) - balance->cop_limit[axis];
      });
  add("cop_measured_max",
      "largest CoP of the resultant as the feet's sensors read it, without them as observed",
      [size](const RunRecord& run, int64_t t, int axis) {
        return size(MeasuredCop(run, t), axis);
      });
}

std::vector<Interval> StepNeeded(const RunRecord& run) {
  return Intervals(
      run, OfTick(run.planner, [](const planner_status_t& p) { return p.step_needed != 0; }));
}

/// s from the last begin of "step needed" to the fall, 0 when a fall was not announced.
Answer WarningTime(const RunRecord& run) {
  const std::optional<int64_t> fall = DownTick(run);
  if (!fall || run.planner.empty()) return {};
  double warning = 0;
  for (const Interval& interval : StepNeeded(run)) {
    const bool lasts = interval.begin < *fall && interval.end.value_or(*fall) >= *fall;
    if (lasts) warning = run.duration(*fall - interval.begin);
  }
  return warning;
}

void AddCapturePoint(MetricList* list) {
  list->push_back({"capture_margin_min", "mm",
                   "capture point inside the soles' hull (negative: outside), smallest",
                   [](const RunRecord& run) {
                     const auto margin = OfTick(run.planner, [](const planner_status_t& planner) {
                       return planner.capture_margin;
                     });
                     return Scaled(Minimum(run, margin), kMilli);
                   }});
  list->push_back({"step_needed_first", "s", "first said that a step is needed",
                   [](const RunRecord& run) -> Answer {
                     const std::vector<Interval> needed = StepNeeded(run);
                     if (needed.empty()) return {};
                     return run.time(needed.front().begin);
                   }});
  list->push_back({"step_needed_time", "s", "time in which a step was said to be needed, in sum",
                   [](const RunRecord& run) -> Answer {
                     if (run.planner.empty()) return {};
                     int64_t ticks = 0;
                     for (const Interval& interval : StepNeeded(run)) {
                       ticks += interval.end.value_or(run.num_ticks) - interval.begin;
                     }
                     return run.duration(ticks);
                   }});
  list->push_back({"step_warning_time", "s",
                   "from saying that a step is needed to the fall; 0: not announced", WarningTime});
}

}  // namespace

void AddBalancing(MetricList* list) {
  AddIntervals(list);
  AddCop(list);
  AddCapturePoint(list);
}

}  // namespace poise::logging
