// A run's log without what its own components make again.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "components/framework/component_registry.h"

namespace poise::logging {

/// Called as ticks are made again; false stops, with a LogError.
using OnTick = std::function<bool(int64_t ticks, int64_t of)>;

struct PackResult {
  uint64_t bytes = 0;         ///< of the log
  uint64_t packed_bytes = 0;  ///< of the packed one
  int64_t ticks = 0;
};

/// Writes `packed`, an LCM event log: RUN_INFO, the events that no component of the graph wrote
/// (HEALTH_*), and LOG_PACK with a check sum of every 4,096 events. The whole run is made again
/// from RUN_INFO first, in memory: only a log that comes out byte for byte is packed. Leaves the
/// log. Throws LogError: a log that is damaged, in real time, cut, or with messages from outside;
/// one that comes out otherwise, naming its first tick; `packed` exists.
PackResult PackLog(const std::string& log, const std::string& packed,
                   const ComponentRegistry& registry, const OnTick& on_tick);

/// Writes `log`, the bytes that were packed. It is there when it is whole. Throws LogError: no
/// packed log; this build makes other bits; `log` exists.
PackResult UnpackLog(const std::string& packed, const std::string& log,
                     const ComponentRegistry& registry, const OnTick& on_tick);

/// The run_info of a packed log is that of its run. False for any other file.
bool IsPackedLog(const std::string& path);

}  // namespace poise::logging
