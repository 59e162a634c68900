#include "hw_bridge/ethercat/links/slot_link.h"

#include <algorithm>

#include "hw_bridge/ethercat/links/bytes.h"

namespace poise::ethercat {

void SlotLink::Set(State state) {
  state_.store(state, std::memory_order_release);
  state_.notify_all();
}

int SlotLink::AwaitChange(std::initializer_list<State> from) {
  int state = state_.load(std::memory_order_acquire);
  while (std::ranges::find(from, state) != from.end()) {
    state_.wait(state, std::memory_order_acquire);
    state = state_.load(std::memory_order_acquire);
  }
  return state;
}

int64_t SlotLink::Now() const {
  // A thread that counts on time to pass gets through its timeouts after the last cycle too.
  if (closed()) return now_.load() + (after_close_ += kSecond);
  return now_.load(std::memory_order_acquire);
}

bool SlotLink::Send(std::span<const uint8_t> frame) {
  if (closed() || frame.size() > frame_.size() || FrameReader(frame).num_datagrams() != 1) {
    return false;
  }
  std::copy(frame.begin(), frame.end(), frame_.begin());
  size_ = frame.size();
  sent_ = true;
  Set(kPosted);
  return true;
}

size_t SlotLink::Receive(std::span<uint8_t> frame, int64_t deadline) {
  if (sent_) {
    const int state = AwaitChange({kPosted, kUnderWay});
    sent_ = false;
    const size_t size = state == kAnswered ? std::min(size_, frame.size()) : 0;
    std::copy_n(frame_.begin(), size, frame.begin());
    Set(kRunning);
    return size;
  }
  if (closed() || deadline <= now_.load(std::memory_order_acquire)) return 0;
  wake_.store(deadline, std::memory_order_release);
  Set(kSleeping);
  static_cast<void>(AwaitChange({kSleeping}));
  Set(kRunning);
  return 0;
}

std::optional<Datagram> SlotLink::Take() {
  if (state_.load(std::memory_order_acquire) != kPosted) return std::nullopt;
  state_.store(kUnderWay, std::memory_order_release);
  return FrameReader(std::span(frame_).first(size_)).Next();
}

void SlotLink::Answer(const Datagram& datagram) {
  if (state_.load(std::memory_order_acquire) != kUnderWay) return;
  const std::span<uint8_t> bytes = std::span(frame_).subspan(kFrameHeader);
  const size_t room = size_ - kFrameHeader - kDatagramOverhead;
  Put<uint16_t>(bytes, 2, datagram.adp);
  std::copy_n(datagram.data.begin(), std::min(room, datagram.data.size()),
              bytes.begin() + kDatagramHeader);
  Put<uint16_t>(bytes, kDatagramHeader + room, datagram.working_counter);
  Set(kAnswered);
}

void SlotLink::Lost() {
  if (state_.load(std::memory_order_acquire) == kUnderWay) Set(kLost);
}

void SlotLink::Advance(int64_t now) {
  now_.store(now, std::memory_order_release);
  if (now < wake_.load(std::memory_order_acquire)) return;
  int sleeping = kSleeping;
  if (state_.compare_exchange_strong(sleeping, kRunning)) state_.notify_all();
}

void SlotLink::Settle() {
  // What was answered or lost has still to be looked at.
  static_cast<void>(AwaitChange({kRunning, kAnswered, kLost}));
}

void SlotLink::Close() {
  closed_.store(true, std::memory_order_release);
  for (int waiting : {kPosted, kUnderWay, kSleeping}) {
    if (state_.compare_exchange_strong(waiting, kLost)) state_.notify_all();
  }
}

}  // namespace poise::ethercat
