// The metrics by subject, as metrics.cc lists them. Not for users of metrics.h.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "logging/metrics/analysis.h"
#include "logging/metrics/metrics.h"

namespace poise::logging {

using MetricList = std::vector<Metric>;

inline constexpr const char* kAxis[] = {"x", "y", "z"};
inline constexpr const char* kFoot[] = {"right", "left"};

inline Answer Scaled(Answer value, double factor) {
  if (value) *value *= factor;
  return value;
}

/// `compute` of the run that this one is compared with, over its own window; empty without one.
inline Answer OfReference(const RunRecord& run,
                          const std::function<Answer(const RunRecord&)>& compute) {
  return run.reference ? compute(*run.reference) : Answer();
}

/// Root of the mean of squares that are given.
class MeanSquare {
 public:
  void Add(double square) {
    sum_ += square;
    ++count_;
  }
  Answer Root() const {
    if (count_ == 0) return {};
    return std::sqrt(sum_ / static_cast<double>(count_));
  }

 private:
  double sum_ = 0;
  int64_t count_ = 0;
};

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
