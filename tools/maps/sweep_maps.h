// The maps of a sweep or of a search for limits.
#pragma once

#include <string>
#include <vector>

#include "tools/sweep/sweep_results.h"

namespace poise {

/// Charts as SVG. What fell has a mark of its own and no part in the range of any other value.
struct SweepMaps {
  std::vector<std::string> survival;   ///< of what stands, or the limit over the variables
  std::vector<std::string> metrics;    ///< of what the runs measured
  std::vector<std::string> constants;  ///< sentences: metrics that would give an empty chart
  /// Every chart, survival first.
  std::vector<std::string> all() const;
};

/// The maps that the sweep asks for, or one of each pair of variables, or of one variable a curve
/// of each metric; of limits, the limit over the variables. Polar where a variable is an angle.
/// Each mark tells the command that runs it again; `what`: scenario, and flags that the sweep does
/// not know, as that command names them; empty: the sweep's scenario.
SweepMaps MapCharts(const SweepHeader& header, const SweepRows& rows, const std::string& what = "");

/// A page of them that opens without a network; it begins with where survival ends.
std::string MapsPage(const SweepHeader& header, const SweepRows& rows, const SweepMaps& maps);

}  // namespace poise
