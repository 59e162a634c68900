// What a sweep's variables and metrics are called in charts: words and units instead of paths.
#pragma once

#include <string>

#include "tools/sweep/sweep.pb.h"

namespace poise {

/// "direction", or "peak of push[0]" for the field sim.push[0].peak.
std::string PlainName(const Variable& variable);
std::string PlainName(const Limit& limit);

/// The variable is the run's seed, which has no order.
bool IsSeed(const Variable& variable);

/// The unit is the variable's own, else that of the scenario's field which it sets; "°" of an
/// angle; it may be empty.
std::string UnitOf(const Variable& variable);
std::string UnitOf(const Limit& limit);

/// A metric's name and unit: in words; a name that this version does not know stays.
std::string MetricLabel(const std::string& metric);
std::string MetricUnit(const std::string& metric);

}  // namespace poise
