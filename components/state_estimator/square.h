// What standard deviations become variances by.
#pragma once

namespace poise {

inline double Square(double x) { return x * x; }

}  // namespace poise
