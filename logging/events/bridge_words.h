// The bridge's states and reasons, for people.
#pragma once

#include <cstdint>
#include <string>

#include "logging/element_names.h"
#include "poise/bridge_status_t.hpp"

namespace poise::logging {

/// The bridge's states and reasons (bridge_status_t) in words: "damping", "no command"; an empty
/// reason for none.
std::string BridgeStateName(int8_t state);
std::string BridgeReasonName(int8_t reason);
/// With the joint that it is about: "joint too fast (right_knee_pitch)".
std::string BridgeReasonText(const bridge_status_t& bridge, const ElementNames& names);

}  // namespace poise::logging
