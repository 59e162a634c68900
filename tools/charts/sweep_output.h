// The files that a sweep's folder holds beside its results.
#pragma once

#include <filesystem>

#include "tools/sweep/sweep_results.h"

namespace poise {

/// Writes table.csv, limits.csv of a search for limits, charts.json and charts.html, of the rows
/// there are. Throws ConfigError.
void WriteSweepFiles(const std::filesystem::path& folder, const SweepHeader& header,
                     const SweepRows& rows);

/// False when a row does not tell whether the robot stood; says on stderr which do not.
bool AllRan(const SweepRows& rows);

/// Writes as WriteSweepFiles, prints what the runs came to and which files there are, and says on
/// stderr which runs are missing. False as AllRan. Throws ConfigError.
bool Deliver(const std::filesystem::path& folder, const SweepHeader& header, const SweepRows& rows);

}  // namespace poise
