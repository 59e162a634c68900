// What a sweep or a search for limits came to, as data of a page: docs/reference/charts.md.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/sweep/sweep_results.h"

namespace poise {

/// A part of charts.json: variables, values, rows, and which charts are drawn of them: those that
/// the sweep asks for, or one of each pair of variables, or of one variable one of each metric; of
/// limits, the limit over the variables. `what`: scenario, and flags that the sweep does not know,
/// as the command of a run names them; empty: the sweep's scenario. `folder`: where runs that were
/// kept lie.
nlohmann::ordered_json SweepChartsPart(const SweepHeader& header, const SweepRows& rows,
                                       const std::string& what = "",
                                       const std::filesystem::path& folder = {});

/// charts.json of this sweep alone.
nlohmann::ordered_json SweepCharts(const SweepHeader& header, const SweepRows& rows,
                                   const std::filesystem::path& folder = {});

}  // namespace poise
