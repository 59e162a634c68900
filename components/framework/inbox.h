// One input of a component in a process: from raw packets to the message that a stage reads.
#pragma once

#include <cstdint>
#include <vector>

#include "components/framework/owned_message.h"
#include "components/framework/packet_filter.h"

namespace poise {

/// Joins by tick: keeps what comes early, refuses what does not belong, tells duplicates. All
/// memory is taken at construction.
class Inbox {
 public:
  Inbox(InputPort* port, int64_t run_id);

  /// A packet of this input's channel.
  void Offer(const uint8_t* data, size_t size);

  /// From now on the stage wants the message of `tick` (kSameTick, kPreviousTick).
  void Want(int64_t tick);
  int64_t wanted() const { return want_; }
  /// True when the wanted message is there. kLatest: always.
  bool ready() const { return ready_ || port_->kind() == InputKind::kLatest; }
  /// Shows the wanted (or latest) message to the component, or nothing.
  void Show(bool absent);
  void Hide() { port_->Bind(nullptr); }
  /// The wanted message had to be asked for: counts once for each that is wanted.
  void CountGap() {
    gaps_ += asked_ ? 0 : 1;
    asked_ = true;
  }

  const InputPort& port() const { return *port_; }
  const PacketCounters& counters() const { return counters_; }
  int64_t duplicates() const { return duplicates_; }
  int64_t gaps() const { return gaps_; }

 private:
  PacketVerdict Keep(const uint8_t* data, size_t size);

  InputPort* port_;
  PacketFilter filter_;
  OwnedMessage message_;
  OwnedMessage scratch_;
  size_t size_;
  std::vector<uint8_t> bytes_;  // kReceiveWindow packets, by tick modulo
  std::vector<int64_t> ticks_;  // -1: empty
  int64_t want_ = 0;
  bool ready_ = false;
  bool asked_ = false;
  PacketCounters counters_;
  int64_t duplicates_ = 0;
  int64_t gaps_ = 0;
};

}  // namespace poise
