// Where survival ends, in words.
#pragma once

#include <string>
#include <vector>

#include "tools/sweep/sweep_results.h"

namespace poise {

/// Sentences: how many runs stand, and up to which values of which variable; of a random sweep,
/// among which values the others lie; of limits, from where to where they reach.
std::vector<std::string> SurvivalSentences(const SweepHeader& header, const SweepRows& rows);

}  // namespace poise
