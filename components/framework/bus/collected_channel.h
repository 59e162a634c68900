// One channel as the recorder hears it: packets by tick until their turn comes.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "components/framework/bus/owned_message.h"
#include "components/framework/bus/packet_filter.h"
#include "components/framework/graph.pb.h"

namespace poise {

/// Keeps the first usable packet of each tick in a window. Takes all its memory at construction.
class CollectedChannel {
 public:
  /// `channel` with its counts (FillCounts). Throws ConfigError.
  CollectedChannel(const Channel& channel, int64_t run_id);

  /// A packet of this channel. An accepted one of an external channel is the caller's to deliver;
  /// any other waits in Next().
  PacketVerdict Offer(const uint8_t* data, size_t size);
  /// The packet of next_tick(), size() bytes; nullptr when it has not come. External: nullptr.
  const uint8_t* Next() const;
  /// The packet of next_tick() has been delivered.
  void Advance() { ++next_tick_; }
  /// Gives up on ticks before the first kept one, but not beyond `tick`. Returns how many.
  int64_t SkipTo(int64_t tick);

  size_t size() const { return size_; }
  int64_t next_tick() const { return next_tick_; }
  /// Newest tick kept; -1 at first.
  int64_t newest_tick() const { return newest_tick_; }
  int64_t tick(const uint8_t* data) const { return filter_.tick(data); }
  int64_t duplicates() const { return duplicates_; }
  const PacketCounters& counters() const { return counters_; }

 private:
  PacketVerdict Keep(const uint8_t* data, size_t size);
  bool Decodes(const uint8_t* data) const;

  bool external_;
  std::unique_ptr<InputPort> port_;
  OwnedMessage scratch_;
  size_t size_;
  PacketFilter filter_;
  std::vector<uint8_t> bytes_;  // by tick modulo
  std::vector<int64_t> ticks_;  // -1: empty
  int64_t next_tick_ = 0;
  int64_t newest_tick_ = -1;
  int64_t duplicates_ = 0;
  PacketCounters counters_;
};

}  // namespace poise
