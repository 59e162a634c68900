// Which messages a metric is computed from, and which of them a run lacks.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "logging/metrics/metrics.h"

namespace poise::logging {

/// What Poise's own metric of that name is computed from (Metric::needs).
std::string NeedsOf(std::string_view metric);

/// The metric's needs, each as people read it: "GROUND_TRUTH.joint_torque, else
/// JOINT_COMMAND.torque".
std::vector<std::string> TellNeeds(const Metric& metric);

/// Needs that the run does not meet, "GROUND_TRUTH.com_position": while there are any, a metric
/// without a value is not known. Without any, what it asks for did not happen.
std::vector<std::string> MissingFor(const Metric& metric, const RunRecord& run);

}  // namespace poise::logging
