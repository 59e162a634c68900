#include "components/framework/bus/inbox.h"

#include <algorithm>
#include <cstring>

namespace poise {

Inbox::Inbox(InputPort* port, int64_t run_id, Join join, size_t component)
    : port_(port),
      acts_(dynamic_cast<ActInput*>(port)),
      component_(component),
      join_(join),
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
    if (acts_ != nullptr) {
      acts_->Offer(*static_cast<const operate::act_t*>(scratch_.get()));
      return verdict;
    }
    port_->CopyMessage(scratch_.get(), message_.get());
    ready_ = true;
    return verdict;
  }
  const int64_t first = std::max<int64_t>(0, want_ - kReceiveWindow);
  const int64_t last =
      join_ == Join::kNewest ? std::max(horizon_, want_) : want_ + kReceiveWindow - 1;
  const PacketVerdict verdict = filter_.Check(data, size, first, last);
  if (verdict != PacketVerdict::kAccepted) return verdict;
  const int64_t tick = filter_.tick(data);
  const auto slot = static_cast<size_t>(tick % kReceiveWindow);
  uint8_t* const kept = bytes_.data() + slot * size_;
  if (ticks_[slot] == tick) {
    if (std::memcmp(kept, data, size) != 0) return PacketVerdict::kConflicting;
    ++duplicates_;
    return verdict;
  }
  const bool late = tick < want_;
  if (late && (join_ != Join::kLate || tick <= shown_)) return PacketVerdict::kStaleTick;
  if (ticks_[slot] > tick) return PacketVerdict::kStaleTick;  // its place went to a later one
  // Decoded now, wanted or not: a packet that cannot be used must not take the place of the right
  // one.
  OwnedMessage& target = tick == want_ ? message_ : scratch_;
  if (!port_->Decode(data, static_cast<int>(size), target.get())) return PacketVerdict::kNotFinite;
  std::memcpy(kept, data, size);
  ticks_[slot] = tick;
  newest_ = std::max(newest_, tick);
  if (tick == want_) ready_ = true;
  if (late) late_ = std::max(late_, tick);
  return verdict;
}

void Inbox::Want(int64_t tick) {
  if (join_ == Join::kLate && Has(want_) && want_ > shown_ && want_ < tick) {
    late_ = std::max(late_, want_);  // came after its cycle
  }
  want_ = tick;
  asked_ = false;
  const auto slot = static_cast<size_t>(tick % kReceiveWindow);
  ready_ = ticks_[slot] == tick &&
           port_->Decode(bytes_.data() + slot * size_, static_cast<int>(size_), message_.get());
}

void Inbox::TakeLate() {
  if (ready_ || late_ <= shown_ || !Has(late_)) return;
  const auto slot = static_cast<size_t>(late_ % kReceiveWindow);
  if (!port_->Decode(bytes_.data() + slot * size_, static_cast<int>(size_), message_.get())) return;
  shown_ = late_;
  ready_ = true;
}

void Inbox::Show(bool absent) {
  const bool show = !absent && ready_;
  port_->Bind(show ? message_.get() : nullptr);
  // A late message has been shown under its own tick.
  if (show && port_->kind() != InputKind::kLatest && Has(want_)) shown_ = want_;
}

}  // namespace poise
