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

MetricList& Known() {
  static MetricList list = [] {
    MetricList own;
    own.reserve(kMostMetrics);  // pointers to them last
    AddOutcome(&own);
    AddMotion(&own);
    AddBalancing(&own);
    AddWrenches(&own);
    AddTorques(&own);
    AddDrives(&own);
    AddTransitions(&own);
    AddSensors(&own);
    AddEstimator(&own);
    AddObserver(&own);
    AddStepping(&own);
    AddWalking(&own);
    AddLog(&own);
    for (Metric& metric : own) metric.needs = NeedsOf(metric.name);
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
  const auto metric = std::ranges::find(Known(), name, &Metric::name);
  return metric == Known().end() ? nullptr : &*metric;
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
