#include <cmath>

#include "fmt/format.h"
#include "logging/metric_groups.h"

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
  add("cop_max", "largest CoP of the computed resultant", of(&balance_torque_t::cop));
  add("cop_limit", "limit of the CoP, (37), (38)", of(&balance_torque_t::cop_limit));
  add("cop_excess", "largest computed CoP beyond its limit (negative: inside)",
      [](const RunRecord& run, int64_t t, int axis) -> Answer {
        const balance_torque_t* balance = run.balance.at(t);
        if (balance == nullptr) return {};
        return std::abs(balance->cop[axis]) - balance->cop_limit[axis];
      });
  add("cop_measured_max", "largest CoP of the measured resultant",
      [](const RunRecord& run, int64_t t, int axis) -> Answer {
        const auto cop = MeasuredCop(run, t);
        if (!cop) return {};
        return std::abs((*cop)(axis));
      });
}

}  // namespace

void AddBalancing(MetricList* list) {
  AddIntervals(list);
  AddCop(list);
}

}  // namespace poise::logging
