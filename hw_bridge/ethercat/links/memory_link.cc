#include "hw_bridge/ethercat/links/memory_link.h"

#include <algorithm>

namespace poise::ethercat {

void MemoryLink::AdvanceTo(int64_t time) {
  now_ = std::max(now_, time);
  handler_->AdvanceTo(now_);
}

bool MemoryLink::Send(std::span<const uint8_t> frame) {
  if (count_ == slots_.size() || frame.size() > kMaxFrame) return false;
  Slot& slot = slots_[(first_ + count_) % slots_.size()];
  std::copy(frame.begin(), frame.end(), slot.bytes.begin());
  slot.size = frame.size();
  slot.back = now_ + round_trip_;
  // What is no frame comes back as it was: slaves forward it.
  static_cast<void>(handler_->HandleFrame(std::span(slot.bytes).first(slot.size), now_));
  ++count_;
  return true;
}

size_t MemoryLink::Receive(std::span<uint8_t> frame, int64_t deadline) {
  if (count_ == 0 || slots_[first_].back > std::max(deadline, now_)) {
    AdvanceTo(deadline);
    return 0;
  }
  const Slot& slot = slots_[first_];
  AdvanceTo(slot.back);
  const size_t size = std::min(slot.size, frame.size());
  std::copy_n(slot.bytes.begin(), size, frame.begin());
  first_ = (first_ + 1) % slots_.size();
  --count_;
  return size;
}

}  // namespace poise::ethercat
