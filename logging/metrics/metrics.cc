#include "logging/metrics/metrics.h"

#include <algorithm>

#include "logging/metrics/metric_groups.h"

namespace poise::logging {
namespace {

MetricList MakeMetrics() {
  MetricList list;
  AddOutcome(&list);
  AddMotion(&list);
  AddBalancing(&list);
  AddWrenches(&list);
  AddTorques(&list);
  AddDrives(&list);
  AddTransitions(&list);
  AddSensors(&list);
  AddEstimator(&list);
  AddLog(&list);
  return list;
}

}  // namespace

std::span<const Metric> Metrics() {
  static const MetricList list = MakeMetrics();
  return list;
}

const Metric* FindMetric(std::string_view name) {
  const auto metrics = Metrics();
  const auto metric =
      std::find_if(metrics.begin(), metrics.end(), [&](const Metric& m) { return m.name == name; });
  return metric == metrics.end() ? nullptr : &*metric;
}

}  // namespace poise::logging
