// A standard deviation becomes a variance.
#pragma once

namespace poise {

inline double Square(double x) { return x * x; }

}  // namespace poise
