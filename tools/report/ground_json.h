// The ground of a run as its page draws it: docs/reference/report_format.md.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

#include "sim/sim.pb.h"

namespace poise {

/// The tops of a field of blocks as the simulator has them while nothing stands on them: a list of
/// {"x": [from, to], "y": [from, to], "top": [4 heights], "stiffness"}, m and N/m, the heights at
/// (from, from), (to, from), (to, to), (from, to). Empty without a field, or of one that the
/// simulator refuses. `seed`: the run's.
nlohmann::ordered_json GroundJson(const SimConfig& config, uint64_t seed);

}  // namespace poise
