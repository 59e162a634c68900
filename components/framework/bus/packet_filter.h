// Checks of raw packets before anything decodes them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace poise {

enum class PacketVerdict {
  kAccepted,
  kWrongSize,
  kWrongFingerprint,
  kWrongCounts,
  kWrongRun,
  kStaleTick,    ///< before the window
  kFutureTick,   ///< after the window
  kNotFinite,    ///< decoding refused it or a number is not finite
  kConflicting,  ///< a second, different message for a tick
  kNumVerdicts,
};
const char* ToString(PacketVerdict verdict);

/// Fixed-offset fields of an encoded message with a header; big-endian.
int32_t ReadInt32(const uint8_t* data);
int64_t ReadInt64(const uint8_t* data);

/// The identity that every packet of a channel must show: one exact size, fingerprint, counts and
/// run.
class PacketFilter {
 public:
  PacketFilter(int64_t fingerprint, int encoded_size, std::span<const int32_t> counts,
               int64_t run_id);

  /// Checks size, fingerprint, counts, run_id and first_tick <= tick <= last_tick, in this order.
  /// Reads nothing outside [data, data + size), never throws. A packet that passes is safe to
  /// decode with liblcm.
  PacketVerdict Check(const uint8_t* data, size_t size, int64_t first_tick,
                      int64_t last_tick) const;

  /// Tick of a packet that passed (or whose size is right).
  int64_t tick(const uint8_t* data) const { return ReadInt64(data + run_id_offset_ + 8); }

 private:
  int64_t fingerprint_;
  size_t size_;
  std::vector<int32_t> counts_;
  int64_t run_id_;
  size_t run_id_offset_;
};

class PacketCounters {
 public:
  void Count(PacketVerdict verdict) { ++counts_[static_cast<size_t>(verdict)]; }
  int64_t count(PacketVerdict verdict) const { return counts_[static_cast<size_t>(verdict)]; }
  int64_t accepted() const { return count(PacketVerdict::kAccepted); }
  int64_t refused() const;

 private:
  std::array<int64_t, static_cast<size_t>(PacketVerdict::kNumVerdicts)> counts_{};
};

}  // namespace poise
