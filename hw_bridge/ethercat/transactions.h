// Transactions: acyclic datagrams, each sent in a frame of its own and waited for.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "hw_bridge/ethercat/links/frame.h"
#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {

/// What happened to frames since the start.
struct FrameCounts {
  int64_t sent = 0;
  int64_t returned = 0;
  int64_t lost = 0;        ///< not back by their deadline
  int64_t unexpected = 0;  ///< well formed, but not the answer to what is awaited (late ones too)
  int64_t refused = 0;     ///< no frames
};

/// Sends one datagram at a time and returns what the slaves made of it. Never allocates, never
/// throws.
class Transactions {
 public:
  /// `timeout`: ns for one frame; `attempts` ≥ 1 for each datagram. `link` must outlive this.
  Transactions(Link* link, int64_t timeout, int attempts)
      : link_(link), timeout_(timeout), attempts_(attempts) {}

  /// Working counter; `data` becomes what came back. nullopt: lost in every attempt. `attempts`: in
  /// place of those given at the start.
  std::optional<uint16_t> Execute(Command command, uint16_t adp, uint16_t ado,
                                  std::span<uint8_t> data, std::optional<int> attempts = {});

  /// The index for the next frame, for frames that are sent elsewhere on the same link.
  uint8_t NextIndex() { return ++index_; }
  Link* link() const { return link_; }
  void set_link(Link* link) { link_ = link; }
  const FrameCounts& counts() const { return counts_; }
  FrameCounts* mutable_counts() { return &counts_; }

 private:
  bool Await(const Datagram& sent, std::span<uint8_t> data, uint16_t* working_counter);

  Link* link_;
  int64_t timeout_;
  int attempts_;
  uint8_t index_ = 0;
  FrameBuilder builder_;
  std::array<uint8_t, kMaxFrame> received_{};
  FrameCounts counts_;
};

}  // namespace poise::ethercat
