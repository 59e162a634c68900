// The figures that a run's table can show, by name.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "logging/metrics/analysis.h"

namespace poise::logging {

struct Metric {
  std::string name;  ///< as in Check.metric
  std::string unit;  ///< empty: a number
  std::string description;
  std::function<Answer(const RunRecord& run)> compute;
  /// The joint that the figure is of; none: it is of no single one.
  std::function<std::string(const RunRecord& run)> joint = {};
  /// What it is computed from: "CHANNEL.field, field", several with ";", those of which one will do
  /// with "|", best first (metric_needs.h). Empty: not said; without a value it fails its check.
  std::string needs = {};
};

/// Makes a metric known, before the first table; called by a module's POISE_MODULE. Throws
/// ConfigError when there is one of that name.
void AddMetric(Metric metric);
/// All metrics, in the order in which they are listed: Poise's own, then added ones.
std::span<const Metric> Metrics();
/// nullptr when there is none of that name.
const Metric* FindMetric(std::string_view name);
/// What to say of a name that no metric has: what it is called now, or what is like it.
std::string NoMetric(std::string_view name);

}  // namespace poise::logging
