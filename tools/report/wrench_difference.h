// How far the measured foot wrenches of two runs are apart.
#pragma once

#include <array>
#include <string>

#include "logging/run_record.h"

namespace poise {

/// How a vector differs over the ticks that both runs have.
struct VectorDifference {
  double rms = 0, largest = 0;  ///< norm of the difference
  double time = 0;              ///< s, of the largest, in the scenario's time
  int64_t ticks = 0;            ///< 0: there is nothing to compare
};

struct WrenchDifference {
  VectorDifference force, moment;  ///< N, N·m
};

/// Compares robot_sensors_t::foot_wrench, each in its own sole's frame: right foot, left foot. The
/// runs must be of one scenario.
std::array<WrenchDifference, 2> CompareFootWrenches(const logging::RunRecord& first,
                                                    const logging::RunRecord& second);

/// A row a foot and quantity, in aligned columns; empty without a tick to compare.
std::string FormatWrenchDifferences(const std::array<WrenchDifference, 2>& feet);

}  // namespace poise
