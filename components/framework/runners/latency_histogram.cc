#include "components/framework/runners/latency_histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace poise {

void LatencyHistogram::Add(int64_t nanoseconds) {
  nanoseconds = std::max<int64_t>(nanoseconds, 0);
  const auto value = static_cast<uint64_t>(nanoseconds);
  // Below 2^kSubBits a bucket is 1 ns wide; above, each power of two has 2^kSubBits buckets.
  const int shift = std::max(0, static_cast<int>(std::bit_width(value)) - kSubBits - 1);
  const uint64_t bucket = (static_cast<uint64_t>(shift) << kSubBits) + (value >> shift);
  ++buckets_[std::min(bucket, uint64_t{kNumBuckets - 1})];
  ++count_;
  max_ = std::max(max_, nanoseconds);
}

std::array<int64_t, 64> LatencyHistogram::HalfOctaves() const {
  std::array<int64_t, 64> result{};
  for (int bucket = 0; bucket < kNumBuckets; ++bucket) {
    // Buckets 32 to 47 hold the lower half of the octave that starts at 32 ns, and so on.
    const int half_octave = std::clamp(bucket / 16 - 2, 0, 63);
    result[static_cast<size_t>(half_octave)] += buckets_[static_cast<size_t>(bucket)];
  }
  return result;
}

double LatencyHistogram::Quantile(double quantile) const {
  if (count_ == 0) return 0;
  const auto wanted = std::clamp<int64_t>(
      static_cast<int64_t>(std::ceil(quantile * static_cast<double>(count_))), 1, count_);
  int64_t seen = 0;
  for (int bucket = 0; bucket < kNumBuckets; ++bucket) {
    seen += buckets_[static_cast<size_t>(bucket)];
    if (seen < wanted) continue;
    const int shift = std::max(0, (bucket >> kSubBits) - 1);
    const auto first = static_cast<uint64_t>(bucket - (shift << kSubBits)) << shift;
    const double middle =
        static_cast<double>(first) + 0.5 * static_cast<double>((uint64_t{1} << shift) - 1);
    return std::min(middle, static_cast<double>(max_)) * 1e-3;
  }
  return max();
}

}  // namespace poise
