// The files that a sweep's folder holds beside its results.
#pragma once

#include <filesystem>

#include "tools/sweep/sweep_results.h"

namespace poise {

/// Writes table.csv and maps.html, each map as map_N.svg and map_N.png, and limits.csv of a search
/// for limits, of the rows there are. Says on stderr why there are no PNG files. Throws
/// ConfigError.
void WriteOutput(const std::filesystem::path& folder, const SweepHeader& header,
                 const SweepRows& rows);

/// Prints what the rows came to and which files the folder holds.
void PrintOutput(const std::filesystem::path& folder, const SweepHeader& header,
                 const SweepRows& rows);

/// True when no row is kInvalid or kCrashed; else says on stderr which are.
bool AllRan(const SweepRows& rows);

}  // namespace poise
