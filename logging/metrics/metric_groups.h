// The metrics by subject, as metrics.cc lists them. Not for users of metrics.h.
#pragma once

#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "logging/metrics/analysis.h"
#include "logging/metrics/metrics.h"

namespace poise::logging {

using Compute = std::function<Answer(const RunRecord& run)>;

class MetricList : public std::vector<Metric> {
 public:
  void Add(std::string name, std::string unit, std::string description, Compute compute) {
    push_back({std::move(name), std::move(unit), std::move(description), std::move(compute)});
  }
};

inline constexpr const char* kAxis[] = {"x", "y", "z"};
inline constexpr const char* kFoot[] = {"right", "left"};

inline Answer Scaled(Answer value, double factor) {
  if (value) *value *= factor;
  return value;
}

// A signal tells a number or a truth of each tick, or nothing. It is called as signal(run, tick);
// or as signal(run)(tick), where it looks at the run as a whole first.

/// The signal of a series' messages, of two series' messages where a tick has both.
template <class T, class F>
auto Of(Series<T> RunRecord::*series, F of) {
  return [=](const RunRecord& run) { return OfTick(run.*series, of); };
}
template <class T, class U, class F>
auto Of(Series<T> RunRecord::*series, Series<U> RunRecord::*other, F of) {
  return [=](const RunRecord& run) { return OfTick(run.*series, run.*other, of); };
}

/// `signal` of one run; both outlive it.
template <class Signal>
auto ByTick(const Signal& signal, const RunRecord& run) {
  if constexpr (std::is_invocable_v<const Signal&, const RunRecord&, int64_t>) {
    return [&](int64_t tick) { return signal(run, tick); };
  } else {
    return signal(run);
  }
}

// What metrics compute of a signal, over the ticks from RunRecord::first_tick on that it tells of.

/// Returns the largest value times `factor`.
template <class Signal>
Compute Largest(Signal signal, double factor = 1) {
  return [=](const RunRecord& run) { return Scaled(Maximum(run, ByTick(signal, run)), factor); };
}
template <class Signal>
Compute Smallest(Signal signal, double factor = 1) {
  return [=](const RunRecord& run) { return Scaled(Minimum(run, ByTick(signal, run)), factor); };
}
template <class Signal>
Compute Rms(Signal signal, double factor = 1) {
  return [=](const RunRecord& run) {
    return Scaled(RootMeanSquare(run, ByTick(signal, run)), factor);
  };
}
/// Returns in how many ticks it holds.
template <class Signal>
Compute TicksOf(Signal holds) {
  return [=](const RunRecord& run) { return CountTicks(run, ByTick(holds, run)); };
}
/// Returns for how long it holds, s, in sum.
template <class Signal>
Compute TimeOf(Signal holds) {
  return [ticks = TicksOf(holds)](const RunRecord& run) {
    return Scaled(ticks(run), run.spec.tick_period());
  };
}
/// Returns the first time at which it holds, s.
template <class Signal>
Compute FirstTime(Signal holds) {
  return [=](const RunRecord& run) {
    const auto held = ByTick(holds, run);
    return Minimum(run, [&](int64_t tick) -> Answer {
      return std::optional<bool>(held(tick)).value_or(false) ? Answer(run.time(tick)) : Answer();
    });
  };
}
/// Returns the share of the ticks, of those of which it tells, in which it holds.
template <class Signal>
Compute ShareOf(Signal holds) {
  return [=](const RunRecord& run) {
    const auto held = ByTick(holds, run);
    double told = 0;
    const Answer ticks = CountTicks(run, [&](int64_t tick) {
      const std::optional<bool> holds_now = held(tick);
      told += holds_now.has_value() ? 1 : 0;
      return holds_now;
    });
    return Scaled(ticks, 1 / told);
  };
}
/// Returns its value in the run's last tick, times `factor`.
template <class Signal>
Compute AtEnd(Signal signal, double factor = 1) {
  return
      [=](const RunRecord& run) { return Scaled(ByTick(signal, run)(run.num_ticks - 1), factor); };
}

/// Returns `compute` of the run that a run is compared with, over its own window; nothing without
/// one.
inline Compute OfReference(Compute compute) {
  return [compute = std::move(compute)](const RunRecord& run) {
    return run.reference ? compute(*run.reference) : Answer();
  };
}

void AddOutcome(MetricList* list);    ///< how the run ended, and how long it waited
void AddMotion(MetricList* list);     ///< COM, body and swing foot
void AddBalancing(MetricList* list);  ///< section 5: when it was on, and the CoP
void AddWrenches(MetricList* list);   ///< section 4: ratio, margins, computed and measured wrenches
void AddTorques(MetricList* list);    ///< joints and bridge
void AddDrives(MetricList* list);     ///< what the drives made of the torques, and their bus
void AddTransitions(MetricList* list);  ///< changes of support and touch-downs
void AddSensors(MetricList* list);      ///< push
void AddStepping(MetricList* list);     ///< steps that the planner decided on
void AddWalking(MetricList* list);      ///< speed, error and cost of walking
void AddEstimator(MetricList* list);    ///< errors of the base's estimate, and their covariance
void AddObserver(MetricList* list);     ///< foot wrenches without sensors, and the sensors' faults
void AddLog(MetricList* list);          ///< completeness of the log and of the bus

}  // namespace poise::logging
