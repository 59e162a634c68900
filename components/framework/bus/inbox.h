// One input of a component in a process: from raw packets to the message that a stage reads.
#pragma once

#include <cstdint>
#include <vector>

#include "components/framework/bus/owned_message.h"
#include "components/framework/bus/packet_filter.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"

namespace poise {

/// Which messages of an input that joins by tick are of use.
enum class Join {
  kEvery,   ///< lockstep: each tick's, in order
  kNewest,  ///< real time: those of the wanted tick and later; what is overtaken is skipped
  kLate,  ///< real time, the clock's owner: the wanted tick's, or the newest before it not yet seen
};

/// Joins by tick: keeps what comes early, refuses what does not belong, tells duplicates. All
/// memory is taken at construction.
class Inbox {
 public:
  /// `component`: whose port it is, among those of its process.
  Inbox(InputPort* port, int64_t run_id, Join join = Join::kEvery, size_t component = 0);

  /// A packet of this input's channel.
  void Offer(const uint8_t* data, size_t size);

  /// From now on the stage wants the message of `tick` (kSameTick, kPreviousTick).
  void Want(int64_t tick);
  int64_t wanted() const { return want_; }
  /// True when the wanted message is there. kLatest: always.
  bool ready() const { return ready_ || port_->kind() == InputKind::kLatest; }
  /// Newest tick kept that is wanted or later; -1: none. Not for kLatest inputs.
  int64_t newest() const { return newest_ >= want_ ? newest_ : -1; }
  /// True when the message of a tick is kept.
  bool Has(int64_t tick) const {
    return tick >= 0 && ticks_[static_cast<size_t>(tick % kReceiveWindow)] == tick;
  }
  /// Join::kNewest: greatest tick that is believed. What lies beyond is refused, or a single wrong
  /// packet would overtake everything.
  void set_horizon(int64_t tick) { horizon_ = tick; }
  /// Join::kLate: takes the newest message before the wanted one that has not been shown, if any.
  void TakeLate();
  /// Shows the wanted (or latest) message to the component, or nothing.
  void Show(bool absent);
  void Hide() { port_->Bind(nullptr); }
  /// The wanted message had to be asked for: counts once for each that is wanted.
  void CountGap() {
    gaps_ += asked_ ? 0 : 1;
    asked_ = true;
  }

  const InputPort& port() const { return *port_; }
  size_t component() const { return component_; }
  const PacketCounters& counters() const { return counters_; }
  int64_t duplicates() const { return duplicates_; }
  int64_t gaps() const { return gaps_; }

 private:
  PacketVerdict Keep(const uint8_t* data, size_t size);

  InputPort* port_;
  ActInput* acts_;  // nullptr: a message like others
  size_t component_;
  Join join_;
  PacketFilter filter_;
  OwnedMessage message_;
  OwnedMessage scratch_;
  size_t size_;
  std::vector<uint8_t> bytes_;  // kReceiveWindow packets, by tick modulo
  std::vector<int64_t> ticks_;  // -1: empty
  int64_t want_ = 0;
  int64_t newest_ = -1;
  int64_t shown_ = -1;  // tick of the last message shown, while kLate
  int64_t late_ = -1;   // newest tick in (shown_, want_) that is kept, while kLate
  int64_t horizon_ = kReceiveWindow - 1;
  bool ready_ = false;
  bool asked_ = false;
  PacketCounters counters_;
  int64_t duplicates_ = 0;
  int64_t gaps_ = 0;
};

}  // namespace poise
