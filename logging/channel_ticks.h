// Which messages of a channel a log holds, tick by tick.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/graph.pb.h"
#include "poise/message_traits.hpp"

namespace poise::logging {

/// What a log shows of one channel of the graph.
struct ChannelCompleteness {
  std::string name;
  int64_t messages = 0;
  int64_t missing = 0;       ///< ticks without a message, up to the run's last tick
  int64_t duplicate = 0;     ///< messages of a tick that was there already
  int64_t out_of_order = 0;  ///< messages of an earlier tick than the one before
  int64_t refused = 0;       ///< wrong size, fingerprint, counts, run or tick, or not finite
  int64_t other_type = 0;    ///< of the refused: another type's, or another version's of the type
};

struct TickRange {
  int64_t first = 0;
  int64_t last = 0;
};

/// What is read from a log's RUN_INFO may be damaged. Throws LogError naming `path` and the field:
/// a tick period outside (0, 10] s, a number of ticks that is none, a channel whose type is not
/// known or has strings or whose counts do not fit it.
void CheckLogSpec(const RunSpec& spec, const std::string& path);

/// The type of a channel that CheckLogSpec has passed.
const MessageType& ChannelType(const Channel& channel);
/// Bytes of each message of such a channel, and what it must show.
int64_t MessageSize(const Channel& channel);
PacketFilter ChannelFilter(const RunSpec& spec, const Channel& channel);

/// False when the log, cut from another one, is not to hold the channel.
bool IsKept(const RunSpec& spec, const std::string& channel);

/// Checks the messages of one channel, not an external one, and keeps account of its ticks.
class ChannelTicks {
 public:
  /// CheckLogSpec must have passed. `log_size` (bytes) bounds the ticks that can be: each that the
  /// log is to hold has a record of each channel.
  ChannelTicks(const RunSpec& spec, const Channel& channel, uint64_t log_size);

  /// The tick of a message that belongs to the run and is the first of its tick; then Take or
  /// Refuse must follow. Empty: counted as refused or duplicate.
  std::optional<int64_t> Check(std::span<const uint8_t> data);
  void Take(int64_t tick);
  void Refuse() { ++completeness_.refused; }

  int64_t newest() const { return newest_; }  ///< -1: none
  int64_t refused() const { return completeness_.refused; }
  const std::string& name() const { return completeness_.name; }
  /// What is known of the channel, with what ticks [first, end) lack.
  ChannelCompleteness Completeness(int64_t first, int64_t end) const;
  std::vector<TickRange> Missing(int64_t first, int64_t end) const;

 private:
  PacketFilter filter_;
  int64_t fingerprint_;  // of the channel's type
  int64_t first_tick_;   // that may be
  int64_t end_tick_;     // first that may not
  std::vector<bool> seen_;
  int64_t newest_ = -1;
  ChannelCompleteness completeness_;
};

}  // namespace poise::logging
