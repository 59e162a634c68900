// The minimum-jerk line: the one smooth step of ramps, moves and turns.
#pragma once

#include <algorithm>

namespace poise::balance {

/// 10 s³ − 15 s⁴ + 6 s⁵ with s clamped to [0, 1]: zero slope and curvature at both ends. NaN gives
/// 0.
inline double SmoothStep(double s) {
  if (!(s > 0)) return 0;
  if (s >= 1) return 1;
  return s * s * s * (10 + s * (-15 + 6 * s));
}

/// A move from 0 to 1 in `duration` s along SmoothStep, `elapsed` s after its start; at rest before
/// and after. Duration 0 is a step.
struct MinimumJerk {
  MinimumJerk(double elapsed, double duration) {
    if (duration <= 0) {
      position = elapsed >= 0 ? 1 : 0;
      return;
    }
    const double s = std::clamp(elapsed / duration, 0.0, 1.0);
    position = SmoothStep(s);
    speed = 30 * s * s * (1 - s) * (1 - s) / duration;
    acceleration = 60 * s * (1 - s) * (1 - 2 * s) / (duration * duration);
  }
  double position = 0;      ///< 0 to 1
  double speed = 0;         ///< 1/s
  double acceleration = 0;  ///< 1/s²
};

}  // namespace poise::balance
