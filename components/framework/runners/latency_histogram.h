// Latency statistics of fixed size.
#pragma once

#include <array>
#include <cstdint>

namespace poise {

/// Counts durations in buckets whose width is 1/32 of their value: percentiles are right to 3 %,
/// the maximum is exact.
class LatencyHistogram {
 public:
  /// Negative durations count as 0.
  void Add(int64_t nanoseconds);
  /// Duration, us, that a share `quantile` (0..1) of the samples does not exceed; 0 without
  /// samples.
  double Quantile(double quantile) const;
  double median() const { return Quantile(0.5); }                  ///< us
  double p99() const { return Quantile(0.99); }                    ///< us
  double max() const { return static_cast<double>(max_) * 1e-3; }  ///< us
  int64_t count() const { return count_; }
  /// Samples by half octaves, as health_t::latency_count describes them.
  std::array<int64_t, 64> HalfOctaves() const;

 private:
  static constexpr int kSubBits = 5;
  static constexpr int kNumBuckets = (64 - kSubBits) << kSubBits;
  std::array<int64_t, kNumBuckets> buckets_{};
  int64_t count_ = 0;
  int64_t max_ = 0;
};

}  // namespace poise
