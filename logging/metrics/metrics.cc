#include "logging/metrics/metrics.h"

#include <algorithm>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"
#include "logging/metrics/metric_groups.h"
#include "logging/metrics/metric_needs.h"

namespace poise::logging {
namespace {

constexpr size_t kMostMetrics = 4096;

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
  AddObserver(&list);
  AddStepping(&list);
  AddWalking(&list);
  AddLog(&list);
  for (Metric& metric : list) metric.needs = NeedsOf(metric.name);
  return list;
}

}  // namespace

namespace {

MetricList& Known() {
  static MetricList list = [] {
    MetricList own = MakeMetrics();
    own.reserve(kMostMetrics);  // pointers to them last
    return own;
  }();
  return list;
}

}  // namespace

void AddMetric(Metric metric) {
  if (FindMetric(metric.name) != nullptr) {
    throw ConfigError(fmt::format("metric {} is there twice", metric.name));
  }
  if (Known().size() == kMostMetrics) {
    throw ConfigError(fmt::format("metric {} is one too many", metric.name));
  }
  Known().push_back(std::move(metric));
}

std::span<const Metric> Metrics() { return Known(); }

const Metric* FindMetric(std::string_view name) {
  const auto metrics = Metrics();
  const auto metric =
      std::find_if(metrics.begin(), metrics.end(), [&](const Metric& m) { return m.name == name; });
  return metric == metrics.end() ? nullptr : &*metric;
}

std::string NoMetric(std::string_view name) {
  std::vector<std::string> names;
  for (const Metric& metric : Metrics()) names.push_back(metric.name);
  std::string hint = Suggest(name, std::move(names));
  for (const std::string_view former : {"anchored_feet_", "invariant_ekf_"}) {
    if (!name.starts_with(former)) continue;
    const std::string now = fmt::format("estimator_{}", name.substr(former.size()));
    if (FindMetric(now) != nullptr) hint = fmt::format("write {}", now);
  }
  return fmt::format("there is no metric '{}'; {}; see `poise list metrics`", name, hint);
}

}  // namespace poise::logging
