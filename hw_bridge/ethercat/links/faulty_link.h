// FaultyLink: another link whose frames are lost, damaged, cut or late, for tests and rehearsals.
#pragma once

#include <array>
#include <random>

#include "hw_bridge/ethercat/links/frame.h"
#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {

/// Shares of the frames, 0 to 1, that each fault takes; drawn in this order.
struct LinkFaults {
  double lost_out = 0;   ///< never reaches the slaves
  double lost_back = 0;  ///< processed by the slaves, never returns
  double corrupted = 0;  ///< up to 8 bytes changed on the way back (no checksum told)
  double truncated = 0;  ///< cut on the way back
  double late = 0;       ///< returns after the next frame's return, or never
};

class FaultyLink final : public Link {
 public:
  /// `link` must outlive this.
  FaultyLink(Link* link, uint64_t seed) : link_(link), random_(seed) {}

  void set_faults(const LinkFaults& faults) { faults_ = faults; }

  int64_t Now() const override { return link_->Now(); }
  bool Send(std::span<const uint8_t> frame) override;
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override;

 private:
  bool Draw(double share);
  size_t Below(size_t n) { return n == 0 ? 0 : static_cast<size_t>(random_() % n); }

  Link* link_;
  std::mt19937_64 random_;
  LinkFaults faults_;
  std::array<uint8_t, kMaxFrame> held_{};  // the late frame
  size_t held_size_ = 0;
  bool release_ = false;  // the late frame's turn has come
};

}  // namespace poise::ethercat
