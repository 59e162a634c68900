// What a page's reader does is written out here once more, from docs/reference/report_format.md.
#include "logging/export/column_codec.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/test_seed.h"

namespace poise::logging {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::vector<uint8_t> FromBase64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<uint8_t> bytes;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<uint32_t>(digits.find(c));
    count += 6;
    if (count >= 8) bytes.push_back(static_cast<uint8_t>(bits >> (count -= 8)));
  }
  return bytes;
}

std::vector<double> Unpack(const PackedColumn& column, size_t n) {
  EXPECT_EQ(column.data.size() % 4, 0u);
  const std::vector<uint8_t> packed = FromBase64(column.data);
  std::vector<uint8_t> planes(4 * n);
  uLongf size = planes.size();
  EXPECT_EQ(uncompress(planes.data(), &size, packed.data(), packed.size()), Z_OK);
  EXPECT_EQ(size, planes.size());
  std::vector<int64_t> integers(n);
  for (size_t i = 0; i < n; ++i) {
    int64_t word = 0;
    for (size_t plane = 4; plane-- > 0;) word = 256 * word + planes[plane * n + i];
    integers[i] = word % 2 == 0 ? word / 2 : -(word + 1) / 2;
  }
  for (int k = 0; k < column.order; ++k) {
    for (size_t i = 1; i < n; ++i) {
      integers[i] = static_cast<int32_t>(static_cast<uint32_t>(integers[i] + integers[i - 1]));
    }
  }
  std::vector<double> values(n);
  for (size_t i = 0; i < n; ++i) {
    values[i] =
        integers[i] == -2147483648LL ? kNaN : static_cast<double>(integers[i]) * column.step;
  }
  return values;
}

/// Largest difference after packing and unpacking; NaN must be NaN.
double RoundTripError(const std::vector<double>& values, bool integer = false) {
  const std::vector<double> read = Unpack(PackColumn(values, integer), values.size());
  double error = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(std::isfinite(values[i]), std::isfinite(read[i])) << i;
    if (std::isfinite(values[i])) error = std::max(error, std::abs(values[i] - read[i]));
  }
  return error;
}

TEST(ColumnCodec, ABoundIsNeverInsideOfWhatItBounds) {
  std::mt19937 random(TestSeed(2));
  for (int trial = 0; trial < 40; ++trial) {
    std::normal_distribution<double> noise(std::exp2(trial - 20), std::exp2(0.7 * trial - 15));
    std::vector<double> values(400);
    for (double& x : values) x = noise(random);
    values[7] = kNaN;
    values[9] *= 1e3;  // an outlier
    const PackedColumn low = PackBound(values, Bound::kLeast, false);
    const PackedColumn high = PackBound(values, Bound::kLargest, false);
    const std::vector<double> least = Unpack(low, values.size());
    const std::vector<double> largest = Unpack(high, values.size());
    for (size_t i = 0; i < values.size(); ++i) {
      if (i == 7) {
        EXPECT_TRUE(std::isnan(least[i]) && std::isnan(largest[i]));
        continue;
      }
      EXPECT_LE(least[i], values[i]);
      EXPECT_GE(largest[i], values[i]);
      EXPECT_LE(largest[i] - least[i], low.step + high.step);
    }
  }
}

TEST(ColumnCodec, KeepsAMillionthOfTheSpan) {
  std::mt19937 random(TestSeed(1));
  std::normal_distribution<double> noise(0, 0.01);
  std::vector<double> values;
  for (int i = 0; i < 3000; ++i) values.push_back(5 + 3 * std::sin(0.01 * i) + noise(random));
  EXPECT_LT(RoundTripError(values), 6 * 5e-7);
  EXPECT_GT(RoundTripError(values), 0);
  for (double& value : values) value *= 1e-7;
  EXPECT_LT(RoundTripError(values), 6e-7 * 5e-7);
}

TEST(ColumnCodec, AnOutlierCostsTheRestNothing) {
  std::vector<double> values;
  for (int i = 0; i < 3000; ++i) values.push_back(std::sin(0.01 * i));
  values[1500] = -700;
  EXPECT_LT(RoundTripError(values), 2 * 5e-7);
  values[1500] = 1e12;  // farther out than 31 bits of that step: coarser, and right
  EXPECT_LT(RoundTripError(values), 1e12 * 2e-9);
}

TEST(ColumnCodec, IntegersAreExact) {
  std::vector<double> values = {0, -1, 1, 8191, -1000000, 1000000000, -1000000000, 3};
  EXPECT_EQ(RoundTripError(values, true), 0);
  values.push_back(3.0 * (1LL << 40));  // no 32-bit integer
  EXPECT_LT(RoundTripError(values, true), 3.0 * (1LL << 40) * 2e-9);
}

TEST(ColumnCodec, WhatIsNoFiniteNumberIsNaN) {
  EXPECT_LT(RoundTripError({kNaN, 1, 2, kNaN, std::numeric_limits<double>::infinity(), 3,
                            -std::numeric_limits<double>::infinity()}),
            1e-5);
  EXPECT_EQ(RoundTripError({kNaN, kNaN}), 0);
  EXPECT_LT(RoundTripError({1e308, -1e308}), 1e302);  // 5e-7 of the span
  EXPECT_EQ(RoundTripError({0, 5e-324}), 5e-324);
}

TEST(ColumnCodec, PacksSmoothSignalsByDifferences) {
  std::vector<double> line, parabola;
  for (int i = 0; i < 10000; ++i) {
    line.push_back(2000.0 * i);
    parabola.push_back(1.0 * i * i);
  }
  EXPECT_EQ(PackColumn(line, true).order, 2);  // after the first value all second differences are 0
  EXPECT_EQ(PackColumn(parabola, true).order, 2);
  EXPECT_LT(PackColumn(line, true).data.size(), 400u);
  EXPECT_EQ(RoundTripError(parabola, true), 0);
}

}  // namespace
}  // namespace poise::logging
