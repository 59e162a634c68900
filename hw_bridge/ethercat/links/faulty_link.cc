#include "hw_bridge/ethercat/links/faulty_link.h"

#include <algorithm>

namespace poise::ethercat {

bool FaultyLink::Draw(double share) {
  return share > 0 && std::uniform_real_distribution<double>(0, 1)(random_) < share;
}

bool FaultyLink::Send(std::span<const uint8_t> frame) {
  if (Draw(faults_.lost_out)) return true;
  return link_->Send(frame);
}

size_t FaultyLink::Receive(std::span<uint8_t> frame, int64_t deadline) {
  if (release_) {
    release_ = false;
    const size_t size = std::min(held_size_, frame.size());
    std::copy_n(held_.begin(), size, frame.begin());
    held_size_ = 0;
    return size;
  }
  while (true) {
    size_t size = link_->Receive(frame, deadline);
    if (size == 0) return 0;
    if (Draw(faults_.lost_back)) continue;
    if (Draw(faults_.corrupted)) {
      for (size_t i = 0, n = 1 + Below(8); i < n; ++i) {
        frame[Below(size)] ^= static_cast<uint8_t>(1 + Below(255));
      }
    }
    if (Draw(faults_.truncated)) size = 1 + Below(size);
    if (held_size_ == 0 && Draw(faults_.late)) {
      std::copy_n(frame.begin(), size, held_.begin());
      held_size_ = size;
      continue;
    }
    release_ = held_size_ > 0;
    return size;
  }
}

}  // namespace poise::ethercat
