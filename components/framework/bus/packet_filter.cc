#include "components/framework/bus/packet_filter.h"

namespace poise {

const char* ToString(PacketVerdict verdict) {
  constexpr std::array kNames = {"accepted",     "wrong size", "wrong fingerprint",
                                 "wrong counts", "wrong run",  "stale tick",
                                 "future tick",  "not finite", "conflicting"};
  static_assert(kNames.size() == static_cast<size_t>(PacketVerdict::kNumVerdicts));
  const auto i = static_cast<size_t>(verdict);
  return i < kNames.size() ? kNames[i] : "unknown";
}

int32_t ReadInt32(const uint8_t* data) {
  uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | data[i];
  return static_cast<int32_t>(value);
}

int64_t ReadInt64(const uint8_t* data) {
  uint64_t value = 0;
  for (int i = 0; i < 8; ++i) value = value << 8 | data[i];
  return static_cast<int64_t>(value);
}

PacketFilter::PacketFilter(int64_t fingerprint, int encoded_size, std::span<const int32_t> counts,
                           int64_t run_id)
    : fingerprint_(fingerprint),
      size_(static_cast<size_t>(encoded_size)),
      counts_(counts.begin(), counts.end()),
      run_id_(run_id),
      run_id_offset_(8 + 4 * counts.size()) {}

PacketVerdict PacketFilter::Check(const uint8_t* data, size_t size, int64_t first_tick,
                                  int64_t last_tick) const {
  // A message with a header is never shorter than its header, so the right size makes all reads
  // below safe.
  if (size != size_ || size < run_id_offset_ + 24) return PacketVerdict::kWrongSize;
  if (ReadInt64(data) != fingerprint_) return PacketVerdict::kWrongFingerprint;
  for (size_t i = 0; i < counts_.size(); ++i) {
    if (ReadInt32(data + 8 + 4 * i) != counts_[i]) return PacketVerdict::kWrongCounts;
  }
  if (ReadInt64(data + run_id_offset_) != run_id_) return PacketVerdict::kWrongRun;
  const int64_t message_tick = tick(data);
  if (message_tick < first_tick) return PacketVerdict::kStaleTick;
  if (message_tick > last_tick) return PacketVerdict::kFutureTick;
  return PacketVerdict::kAccepted;
}

int64_t PacketCounters::refused() const {
  int64_t sum = 0;
  for (const int64_t count : counts_) sum += count;
  return sum - accepted();
}

}  // namespace poise
