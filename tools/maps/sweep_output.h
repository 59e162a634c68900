// The files that a sweep's folder holds beside its results.
#pragma once

#include <filesystem>

#include "tools/sweep/sweep_results.h"

namespace poise {

/// Writes table.csv, maps.html where there is a map, and limits.csv of a search for limits, of the
/// rows there are. Throws ConfigError.
void WriteSweepFiles(const std::filesystem::path& folder, const SweepHeader& header,
                     const SweepRows& rows);

/// False when a row does not tell whether the robot stood; says on stderr which do not.
bool AllRan(const SweepRows& rows);

/// Writes as WriteSweepFiles, and each map as map_N.svg. Prints what they came to and which files
/// there are, while the maps that the sweep asks for and those of survival, or with `all_pictures`
/// every map, become map_N.png; says on stderr which pictures and runs are missing. False as
/// AllRan. Throws ConfigError.
bool Deliver(const std::filesystem::path& folder, const SweepHeader& header, const SweepRows& rows,
             bool all_pictures);

}  // namespace poise
