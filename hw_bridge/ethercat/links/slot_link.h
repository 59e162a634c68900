// SlotLink: acyclic datagrams of another thread, one at a time, in the frames of a cycle.
#pragma once

#include <array>
#include <atomic>
#include <initializer_list>
#include <optional>

#include "hw_bridge/ethercat/links/frame.h"
#include "hw_bridge/ethercat/links/link.h"

namespace poise::ethercat {

/// The other thread sees a link: what it sends waits for the next cycle's frame, what it receives
/// is what that brought back; its time is that of the cycles. The cycle never waits for it, but in
/// Settle().
class SlotLink final : public Link {
 public:
  // The other thread's side.
  int64_t Now() const override;
  /// False: closed, or no frame of one datagram.
  bool Send(std::span<const uint8_t> frame) override;
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override;
  bool closed() const { return closed_.load(std::memory_order_acquire); }
  /// The thread's last call: nothing more will be sent.
  void Finish() { Set(kFinished); }

  // The cycle's side. None but Settle waits; none allocates.
  /// The datagram that waits to be sent; it stays valid until Answer or Lost.
  std::optional<Datagram> Take();
  void Answer(const Datagram& datagram);
  /// The datagram under way does not come back.
  void Lost();
  /// The cycle's time, ns.
  void Advance(int64_t now);
  /// Waits until the other thread has sent, sleeps or has finished: then what it does depends on
  /// the cycles alone.
  void Settle();
  /// Ends every wait of the other thread; call it until the thread has ended.
  void Close();

 private:
  enum State : int { kRunning, kPosted, kUnderWay, kAnswered, kLost, kSleeping, kFinished };
  void Set(State state);
  /// Waits while the state is one of these; the state after that.
  int AwaitChange(std::initializer_list<State> from);

  std::atomic<int> state_{kRunning};
  std::atomic<int64_t> now_{0}, wake_{0};
  std::atomic<bool> closed_{false};
  mutable std::atomic<int64_t> after_close_{0};
  std::array<uint8_t, kMaxFrame> frame_{};
  size_t size_ = 0;
  bool sent_ = false;  // of the other thread
};

}  // namespace poise::ethercat
