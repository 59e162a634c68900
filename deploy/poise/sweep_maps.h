// The maps of a sweep or of a search for limits.
#pragma once

#include <string>
#include <vector>

#include "deploy/poise/sweep_results.h"

namespace poise {

/// As SVG: the maps that the sweep asks for, or one of each pair of variables; of limits, the limit
/// over the variables. Polar where a variable is an angle.
std::vector<std::string> MapCharts(const SweepHeader& header, const SweepRows& rows);

/// A page of them that opens without a network.
std::string MapsPage(const SweepHeader& header, const SweepRows& rows,
                     const std::vector<std::string>& charts);

}  // namespace poise
