// Plays a log's messages on the bus again, at the pace of the run.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace poise::logging {

struct PlayResult {
  int64_t messages = 0;  ///< sent
  int64_t failed = 0;    ///< that the system refused to send
  double time = 0;       ///< s of the run, played
};

/// Sends the messages of the graph's channels and of HEALTH_* to `url`, as the recorder mirrors
/// them, in the order of their ticks: tick t at t ticks' time / `speed` after the start. Returns at
/// the end or soon after `stop` gives true. Throws LogError or BusError.
PlayResult PlayLog(const std::string& path, const std::string& url, double speed,
                   const std::function<bool()>& stop);

}  // namespace poise::logging
