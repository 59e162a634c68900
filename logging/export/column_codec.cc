#include "logging/export/column_codec.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "logging/printable.h"

namespace poise::logging {
namespace {

constexpr int32_t kNotANumber = std::numeric_limits<int32_t>::min();
constexpr double kStepsPerSpan = 1 << 20;
constexpr double kBoundStepsPerSpan = 1 << 12;
constexpr double kLargest = 1 << 30;
constexpr double kOutliers = 0.005;  // at each end
constexpr int kMaxOrder = 2;

/// The largest power of two not above `x`, kept in the range of normal numbers.
double PowerOfTwoBelow(double x) {
  if (!(x > std::numeric_limits<double>::min())) return std::numeric_limits<double>::min();
  return std::exp2(std::floor(std::log2(x)));
}

double Step(std::span<const double> values, bool integer, double steps_per_span) {
  std::vector<double> finite;
  finite.reserve(values.size());
  std::ranges::copy_if(values, std::back_inserter(finite),
                       [](double x) { return std::isfinite(x); });
  if (finite.empty()) return 1;
  const auto [low, high] = std::ranges::minmax(finite);
  const double largest = std::max(std::abs(low), std::abs(high));
  double step = 1;
  if (!integer) {
    const auto at = [&](double share) {
      const auto i = static_cast<std::ptrdiff_t>(share * static_cast<double>(finite.size() - 1));
      std::ranges::nth_element(finite, finite.begin() + i);
      return finite[static_cast<size_t>(i)];
    };
    // Divided first: a difference of the largest numbers would be infinite.
    const double span = at(1 - kOutliers) / steps_per_span - at(kOutliers) / steps_per_span;
    step = PowerOfTwoBelow(span > 0 ? span : largest / steps_per_span);
  }
  return std::max(step, 2 * PowerOfTwoBelow(largest / kLargest));
}

std::vector<uint32_t> Quantise(std::span<const double> values, double step,
                               double (*round)(double)) {
  std::vector<uint32_t> result(values.size());
  std::ranges::transform(values, result.begin(), [step, round](double x) {
    return std::bit_cast<uint32_t>(std::isfinite(x) ? static_cast<int32_t>(round(x / step))
                                                    : kNotANumber);
  });
  return result;
}

uint32_t Zigzag(uint32_t x) { return (x << 1) ^ (x >> 31 != 0 ? ~0u : 0u); }

/// Bits that the values take without leading zeros: what deflate of byte planes roughly leaves.
int64_t Cost(const std::vector<uint32_t>& values) {
  int64_t bits = 0;
  for (const uint32_t x : values) bits += std::bit_width(Zigzag(x));
  return bits;
}

std::vector<uint8_t> Planes(const std::vector<uint32_t>& values) {
  std::vector<uint8_t> bytes(values.size() * 4);
  for (size_t plane = 0; plane < 4; ++plane) {
    for (size_t i = 0; i < values.size(); ++i) {
      bytes[plane * values.size() + i] = static_cast<uint8_t>(Zigzag(values[i]) >> (8 * plane));
    }
  }
  return bytes;
}

std::string Deflate(const std::vector<uint8_t>& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, bytes.data(), bytes.size(),
                Z_DEFAULT_COMPRESSION) != Z_OK) {
    throw std::runtime_error("zlib cannot pack a column: out of memory?");
  }
  packed.resize(size);
  return packed;
}

PackedColumn Pack(std::vector<uint32_t> best, double step) {
  PackedColumn column;
  column.step = step;
  int64_t best_cost = Cost(best);
  std::vector<uint32_t> differences = best;
  for (int order = 1; order <= kMaxOrder; ++order) {
    std::adjacent_difference(differences.begin(), differences.end(), differences.begin());
    const int64_t cost = Cost(differences);
    if (cost >= best_cost) continue;
    best = differences;
    best_cost = cost;
    column.order = order;
  }
  column.data = Base64(Deflate(Planes(best)));
  return column;
}

}  // namespace

PackedColumn PackColumn(std::span<const double> values, bool integer) {
  const double step = Step(values, integer, kStepsPerSpan);
  return Pack(Quantise(values, step, [](double x) { return std::round(x); }), step);
}

PackedColumn PackBound(std::span<const double> values, Bound bound, bool integer) {
  // A step that is a power of two divides without a rounding error.
  const double step = Step(values, integer, kBoundStepsPerSpan);
  const auto down = [](double x) { return std::floor(x); };
  const auto up = [](double x) { return std::ceil(x); };
  return Pack(bound == Bound::kLeast ? Quantise(values, step, down) : Quantise(values, step, up),
              step);
}

}  // namespace poise::logging
