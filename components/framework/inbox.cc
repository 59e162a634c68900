#include "components/framework/inbox.h"

#include <algorithm>
#include <cstring>

#include "components/framework/run.h"

namespace poise {

Inbox::Inbox(InputPort* port, int64_t run_id)
    : port_(port),
      filter_(port->fingerprint(), port->encoded_size(), port->counts(), run_id),
      message_(port),
      scratch_(port),
      size_(static_cast<size_t>(port->encoded_size())),
      bytes_(size_ * kReceiveWindow),
      ticks_(kReceiveWindow, -1) {}

void Inbox::Offer(const uint8_t* data, size_t size) { counters_.Count(Keep(data, size)); }

PacketVerdict Inbox::Keep(const uint8_t* data, size_t size) {
  if (port_->kind() == InputKind::kLatest) {
    const PacketVerdict verdict = filter_.Check(data, size, INT64_MIN, INT64_MAX);
    if (verdict != PacketVerdict::kAccepted) return verdict;
    if (!port_->Decode(data, static_cast<int>(size), scratch_.get()))
      return PacketVerdict::kNotFinite;
    port_->CopyMessage(scratch_.get(), message_.get());
    ready_ = true;
    return verdict;
  }
  const int64_t first = std::max<int64_t>(0, want_ - kReceiveWindow);
  const PacketVerdict verdict = filter_.Check(data, size, first, want_ + kReceiveWindow - 1);
  if (verdict != PacketVerdict::kAccepted) return verdict;
  const int64_t tick = filter_.tick(data);
  const auto slot = static_cast<size_t>(tick % kReceiveWindow);
  uint8_t* const kept = bytes_.data() + slot * size_;
  if (ticks_[slot] == tick) {
    if (std::memcmp(kept, data, size) != 0) return PacketVerdict::kConflicting;
    ++duplicates_;
    return verdict;
  }
  if (tick < want_) return PacketVerdict::kStaleTick;
  // Decoded now, wanted or not: a packet that cannot be used must not take the place of the right
  // one.
  OwnedMessage& target = tick == want_ ? message_ : scratch_;
  if (!port_->Decode(data, static_cast<int>(size), target.get())) return PacketVerdict::kNotFinite;
  std::memcpy(kept, data, size);
  ticks_[slot] = tick;
  if (tick == want_) ready_ = true;
  return verdict;
}

void Inbox::Want(int64_t tick) {
  want_ = tick;
  asked_ = false;
  const auto slot = static_cast<size_t>(tick % kReceiveWindow);
  ready_ = ticks_[slot] == tick &&
           port_->Decode(bytes_.data() + slot * size_, static_cast<int>(size_), message_.get());
}

void Inbox::Show(bool absent) { port_->Bind(absent || !ready_ ? nullptr : message_.get()); }

}  // namespace poise
