// MemoryLink: slaves in the same process and a clock that only this link moves.
#pragma once

#include <array>

#include "hw_bridge/ethercat/links/frame.h"
#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {

/// Every frame is handled when it is sent and is back after `round_trip`. Waiting moves the clock.
class MemoryLink final : public Link {
 public:
  /// `handler` must outlive the link. round_trip: ns.
  explicit MemoryLink(FrameHandler* handler, int64_t round_trip = 20'000)
      : handler_(handler), round_trip_(round_trip) {}

  int64_t Now() const override { return now_; }
  /// Lets time pass on both sides. Precondition: `time` ≥ Now().
  void AdvanceTo(int64_t time);
  bool Send(std::span<const uint8_t> frame) override;
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override;

 private:
  struct Slot {
    std::array<uint8_t, kMaxFrame> bytes;
    size_t size = 0;
    int64_t back = 0;  // ns
  };

  FrameHandler* handler_;
  int64_t round_trip_;
  int64_t now_ = 0;
  std::array<Slot, 16> slots_;  // a ring
  size_t first_ = 0, count_ = 0;
};

}  // namespace poise::ethercat
