#include "components/framework/bus/collected_channel.h"

#include <algorithm>
#include <cstring>

#include "components/framework/component.h"
#include "components/framework/run.h"
#include "fmt/format.h"

namespace poise {
namespace {

std::unique_ptr<InputPort> MakePort(const Channel& channel) {
  const MessageType* type = FindMessageType(channel.type());
  if (type == nullptr || type->has_strings) {
    throw ConfigError(fmt::format("channel {}: '{}' is no message type of a channel",
                                  channel.name(), channel.type()));
  }
  const MessageCounts counts(channel.count().begin(), channel.count().end());
  if (counts.size() != type->count_names.size()) {
    throw ConfigError(fmt::format(
        "channel {}: the run gives {} counts, {} has {}; fill them in from the checked graph",
        channel.name(), counts.size(), channel.type(), type->count_names.size()));
  }
  std::unique_ptr<InputPort> port;
  ForEachMessageType([&]<class T>() {
    if constexpr (MessageTraits<T>::kHasHeader && !MessageTraits<T>::kHasStrings) {
      if (channel.type() == MessageTraits<T>::kName) port = std::make_unique<Input<T>>();
    }
  });
  if (port == nullptr) {
    throw ConfigError(fmt::format("channel {}: '{}' is no message type of a channel",
                                  channel.name(), channel.type()));
  }
  Wiring().AddInput(port.get(), channel.name(), counts);
  return port;
}

}  // namespace

CollectedChannel::CollectedChannel(const Channel& channel, int64_t run_id)
    : external_(channel.external()),
      port_(MakePort(channel)),
      scratch_(port_.get()),
      size_(static_cast<size_t>(port_->encoded_size())),
      filter_(port_->fingerprint(), port_->encoded_size(), port_->counts(), run_id),
      bytes_(external_ ? 0 : size_ * kSentHistory),
      ticks_(external_ ? 0 : kSentHistory, -1) {}

PacketVerdict CollectedChannel::Offer(const uint8_t* data, size_t size) {
  const PacketVerdict verdict = Keep(data, size);
  counters_.Count(verdict);
  return verdict;
}

bool CollectedChannel::Decodes(const uint8_t* data) const {
  return port_->Decode(data, static_cast<int>(size_), scratch_.get());
}

PacketVerdict CollectedChannel::Keep(const uint8_t* data, size_t size) {
  if (external_) {
    const PacketVerdict verdict = filter_.Check(data, size, INT64_MIN, INT64_MAX);
    if (verdict != PacketVerdict::kAccepted) return verdict;
    return Decodes(data) ? verdict : PacketVerdict::kNotFinite;
  }
  const PacketVerdict verdict =
      filter_.Check(data, size, std::max<int64_t>(0, next_tick_ - kReceiveWindow),
                    next_tick_ + kReceiveWindow - 1);
  if (verdict != PacketVerdict::kAccepted) return verdict;
  const int64_t tick = filter_.tick(data);
  const auto slot = static_cast<size_t>(tick % kSentHistory);
  uint8_t* const kept = bytes_.data() + slot * size_;
  if (ticks_[slot] == tick) {
    if (std::memcmp(kept, data, size_) != 0) return PacketVerdict::kConflicting;
    ++duplicates_;
    return verdict;
  }
  if (tick < next_tick_) return PacketVerdict::kStaleTick;
  // A packet that no reader could use must not take the place of the right one.
  if (!Decodes(data)) return PacketVerdict::kNotFinite;
  std::memcpy(kept, data, size_);
  ticks_[slot] = tick;
  newest_tick_ = std::max(newest_tick_, tick);
  return verdict;
}

int64_t CollectedChannel::SkipTo(int64_t tick) {
  const int64_t first = next_tick_;
  while (next_tick_ < tick && Next() == nullptr) ++next_tick_;
  return next_tick_ - first;
}

const uint8_t* CollectedChannel::Next() const {
  if (external_) return nullptr;
  const auto slot = static_cast<size_t>(next_tick_ % kSentHistory);
  return ticks_[slot] == next_tick_ ? bytes_.data() + slot * size_ : nullptr;
}

}  // namespace poise
