// The same sweep in two engines: where what comes out is the same.
#pragma once

#include <string>

#include "tools/sweep/sweep_results.h"

namespace poise {

/// One engine's.
struct EngineRows {
  std::string engine;
  SweepRows rows;
};

/// In words: in how many of the runs that both have the outcome is the same, which runs differ,
/// and, of a grid, for each variable of numbers that is no angle, how far the largest values that
/// stand are apart at the points of the other variables.
std::string FormatAgreement(const Sweep& sweep, const EngineRows& first, const EngineRows& second);

}  // namespace poise
