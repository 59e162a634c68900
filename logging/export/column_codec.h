// Columns of numbers packed for a page: fixed point, differences, byte planes, deflate, base64.
#pragma once

#include <span>
#include <string>

namespace poise::logging {

/// What a reader needs beside `data`: value = step * integer, INT32_MIN is NaN (and infinity). The
/// integers are differenced `order` times (modulo 2^32, the value before the first is 0), then
/// zigzag-coded, and their bytes stand plane by plane, lowest first, in a zlib stream.
struct PackedColumn {
  double step = 1;
  int order = 0;     ///< 0, 1 or 2: which packs best
  std::string data;  ///< base64
};

/// The step is a power of two: of an integer column 1, else 2^-20 of the span that 99 % of the
/// values take, so that a rounding error is below 5e-7 of it; in both cases coarser where the
/// largest value would not fit into 31 bits. Throws std::runtime_error when zlib does.
PackedColumn PackColumn(std::span<const double> values, bool integer);

/// A bound of values, rounded away from them: no value lies beyond it. The step is coarser, 2^-12
/// of the span that 99 % of the bounds take.
enum class Bound { kLeast, kLargest };
PackedColumn PackBound(std::span<const double> values, Bound bound, bool integer);

}  // namespace poise::logging
