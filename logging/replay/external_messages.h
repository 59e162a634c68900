// In which tick a component read the messages that have no tick of their own.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "logging/tick_series.h"
#include "poise/bridge_status_t.hpp"

namespace poise::logging {

struct ExternalMessage {
  int64_t tick = 0;      ///< from which on its reader is shown it; at first that of the recording
  bool certain = false;  ///< the log tells that tick, or it makes no difference
  std::span<const uint8_t> data;
};

/// The message of a tick; none where the log has none, or it is not decodable.
std::optional<bridge_status_t> StatusAt(const Series<std::span<const uint8_t>>& statuses,
                                        int64_t tick);

/// Sets the ticks of `stops` (emergency_stop_t, in order) from the `statuses` (bridge_status_t by
/// tick) of the bridge that read them: a stop is read in the tick in which the state becomes
/// STATE_ESTOP, a reset in the one in which `resets` grows; what repeats the message before it
/// changes nothing. Only near the tick of the recording, which processes may be apart from by their
/// lead and receive window. The order is kept.
void PlaceEmergencyStops(const Series<std::span<const uint8_t>>& statuses,
                         std::vector<ExternalMessage>* stops);

}  // namespace poise::logging
