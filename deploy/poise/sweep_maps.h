// The maps of a sweep or of a search for limits.
#pragma once

#include <string>

#include "deploy/poise/sweep_results.h"

namespace poise {

/// A page that opens without a network: the maps that the sweep asks for, or one of each pair of
/// variables; of limits, the limit over the variables. Polar where a variable is an angle.
std::string MapsPage(const SweepHeader& header, const SweepRows& rows);

}  // namespace poise
