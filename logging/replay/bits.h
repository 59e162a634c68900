// Check sums of a run's messages, to compare its bits with a record of them.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace poise::logging {

/// One channel's messages of a run in lockstep, from tick 0 on, run_id taken for 0.
struct ChannelBits {
  std::string name;
  uint64_t crc64 = 0;  ///< CRC-64/XZ of all messages, in order
  /// The last byte of the CRC up to each tick: a difference shows in its own tick with 255/256, and
  /// in crc64 for certain.
  std::vector<uint8_t> by_tick;
};

/// The channels of a log's graph, in the graph's order, external ones aside. Throws LogError: the
/// log cannot be read, or lacks a tick of a channel.
std::vector<ChannelBits> BitsOfLog(const std::string& path);

/// The first place where a run is not as recorded.
struct BitsDifference {
  int64_t tick = 0;
  std::string channel;  ///< at that tick the first one in the graph's order
  std::string what;     ///< "its message differs", "the record lacks it", "the run lacks it"
};

/// Empty when both are the same in every bit.
std::optional<BitsDifference> FirstDifference(const std::vector<ChannelBits>& recorded,
                                              const std::vector<ChannelBits>& seen);

/// A text for each channel: its check sum, number of ticks and name; without the bytes by tick.
nlohmann::ordered_json BitsJson(const std::vector<ChannelBits>& bits);
/// Bytes by tick, one channel after the other.
std::string BitsBytes(const std::vector<ChannelBits>& bits);
/// The inverse of both. Throws LogError when they are none, or do not fit each other.
std::vector<ChannelBits> ParseBits(const nlohmann::json& json, const std::string& bytes);

}  // namespace poise::logging
