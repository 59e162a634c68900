#include "components/framework/runners/latency_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/test_seed.h"

namespace poise {
namespace {

TEST(LatencyHistogram, AgreesWithSortedSamples) {
  std::mt19937_64 random(TestSeed(1));
  std::lognormal_distribution<double> distribution(9, 2);  // ns, from tens of ns to ms
  LatencyHistogram histogram;
  std::vector<int64_t> samples;
  for (int i = 0; i < 20001; ++i) {
    samples.push_back(static_cast<int64_t>(distribution(random)));
    histogram.Add(samples.back());
  }
  std::sort(samples.begin(), samples.end());
  for (const double quantile : {0.01, 0.1, 0.5, 0.9, 0.99, 0.999}) {
    const auto rank = static_cast<size_t>(std::ceil(quantile * 20001)) - 1;
    const double exact = static_cast<double>(samples[rank]) * 1e-3;
    EXPECT_NEAR(histogram.Quantile(quantile), exact, 0.03 * exact) << quantile;
  }
  EXPECT_DOUBLE_EQ(histogram.max(), static_cast<double>(samples.back()) * 1e-3);
  EXPECT_EQ(histogram.count(), 20001);
}

TEST(LatencyHistogram, CountsByHalfOctaves) {
  LatencyHistogram histogram;
  for (const int64_t ns : {-1, 0, 47}) histogram.Add(ns);   // bin 0: what is shorter, and [32, 48)
  histogram.Add(48);                                        // bin 1: [48, 64)
  for (const int64_t ns : {1024, 1535}) histogram.Add(ns);  // 2^10: bin 10
  histogram.Add(1536);
  histogram.Add(INT64_MAX);
  const auto bins = histogram.HalfOctaves();
  EXPECT_EQ(bins[0], 3);
  EXPECT_EQ(bins[1], 1);
  EXPECT_EQ(bins[10], 2);
  EXPECT_EQ(bins[11], 1);
  EXPECT_EQ(bins[63], 1);
  int64_t sum = 0;
  for (const int64_t bin : bins) sum += bin;
  EXPECT_EQ(sum, histogram.count());
}

TEST(LatencyHistogram, EdgeValues) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.median(), 0);
  histogram.Add(-5);
  EXPECT_EQ(histogram.median(), 0);
  histogram.Add(INT64_MAX);
  EXPECT_DOUBLE_EQ(histogram.max(), static_cast<double>(INT64_MAX) * 1e-3);
  EXPECT_NEAR(histogram.Quantile(1) / histogram.max(), 1, 0.03);
  LatencyHistogram small;  // below 64 ns every value has its own bucket
  for (int64_t i = 0; i < 64; ++i) small.Add(i);
  EXPECT_DOUBLE_EQ(small.Quantile(0.5), 0.031);
}

}  // namespace
}  // namespace poise
