// What `poise` learns from this project.
#include <algorithm>

#include "components/framework/module_entry.h"
#include "foot_load.h"
#include "logging/metrics/metrics.h"

namespace {

/// N, largest filtered load of a foot.
poise::logging::Answer LargestLoad(const poise::logging::RunRecord& run) {
  return poise::logging::Maximum(run, [&](int64_t tick) -> poise::logging::Answer {
    const auto message = run.Other<gait_lab::foot_load_t>("FOOT_LOAD", tick);
    if (!message) return {};
    return *std::max_element(message->load.begin(), message->load.end());
  });
}

}  // namespace

POISE_MODULE {
  poise::AddComponent(gait_lab::FootLoadType());
  poise::logging::AddMetric({.name = "foot_load_peak",
                             .unit = "N",
                             .description = "largest filtered load of a foot",
                             .compute = LargestLoad,
                             .needs = "FOOT_LOAD.load"});
}
