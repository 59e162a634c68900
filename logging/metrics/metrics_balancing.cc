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
  const auto add = [&](const char* name, const char* unit, const char* text, auto field,
                       bool needs_activation) {
    list->Add(name, unit, text, [=](const RunRecord& run) -> Answer {
      const auto balancing = Balancing(run);
      if (!balancing || (needs_activation && balancing->activations == 0)) return {};
      return (*balancing).*field;
    });
  };
  add("balancing_first", "s", "balancing first on", &BalancingIntervals::first, true);
  add("balancing_last", "s", "balancing last on", &BalancingIntervals::last, true);
  add("balancing_active", "s", "time with balancing on, in sum", &BalancingIntervals::active,
      false);
  add("balancing_activations", "", "times that balancing was switched on",
      &BalancingIntervals::activations, false);
}

void AddCop(MetricList* list) {
  // `signal` of an axis.
  const auto add = [&](const char* name, const char* text, auto signal) {
    for (int axis = 0; axis < 2; ++axis) {
      list->Add(fmt::format("{}_{}", name, kAxis[axis]), "mm",
                fmt::format("{}, {} in frame O", text, kAxis[axis]), Largest(signal(axis), kMilli));
    }
  };
  const auto of = [](auto field) {
    return [field](int axis) {
      return Of(&RunRecord::balance,
                [=](const auto& balance) { return std::abs((balance.*field)[axis]); });
    };
  };
  const auto size = [](auto cop_of) {
    return [cop_of](int axis) {
      return [cop_of, axis](const RunRecord& run, int64_t t) -> Answer {
        const std::optional<Eigen::Vector2d> cop = cop_of(run, t);
        return cop ? Answer(std::abs((*cop)(axis))) : Answer();
      };
    };
  };
  add("cop_task_max", "largest CoP that the task torque alone would give",
      of(&balance_torque_t::cop_task));
  add("cop_max", "largest CoP of the computed resultant",
      size([](const RunRecord& run, int64_t t) { return ComputedCop(run, t); }));
  add("cop_limit", "limit of the CoP, (37), (38)", of(&balance_torque_t::cop_limit));
  add("cop_excess", "largest computed CoP beyond its limit (negative: inside)", [](int axis) {
    return Of(&RunRecord::balance, [axis](const auto& balance) {
      return std::abs(balance.cop[axis]) - balance.cop_limit[axis];
    });
  });
  add("cop_measured_max",
      "largest CoP of the resultant as the feet's sensors read it, without them as observed",
      size([](const RunRecord& run, int64_t t) { return MeasuredCop(run, t); }));
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

Answer FirstNeeded(const RunRecord& run) {
  const std::vector<Interval> needed = StepNeeded(run);
  return needed.empty() ? Answer() : run.time(needed.front().begin);
}

/// s, in sum.
Answer TimeNeeded(const RunRecord& run) {
  if (run.planner.empty()) return {};
  int64_t ticks = 0;
  for (const Interval& interval : StepNeeded(run)) {
    ticks += interval.end.value_or(run.num_ticks) - interval.begin;
  }
  return run.duration(ticks);
}

}  // namespace

void AddBalancing(MetricList* list) {
  AddIntervals(list);
  AddCop(list);
  list->Add(
      "capture_margin_min", "mm",
      "capture point inside the soles' hull (negative: outside), smallest",
      Smallest(Of(&RunRecord::planner, [](const auto& planner) { return planner.capture_margin; }),
               kMilli));
  list->Add("step_needed_first", "s", "first said that a step is needed", FirstNeeded);
  list->Add("step_needed_time", "s", "time in which a step was said to be needed, in sum",
            TimeNeeded);
  list->Add("step_warning_time", "s",
            "from saying that a step is needed to the fall; 0: not announced", WarningTime);
}

}  // namespace poise::logging
