#pragma once

#include <algorithm>

namespace poise {

/// A minimum-jerk move from 0 to 1 in `duration` s, `elapsed` s after its start; duration 0: a
/// step.
struct MinimumJerk {
  MinimumJerk(double elapsed, double duration) {
    if (duration <= 0) {
      position = elapsed >= 0 ? 1 : 0;
      return;
    }
    const double s = std::clamp(elapsed / duration, 0.0, 1.0);
    position = s * s * s * (10 + s * (6 * s - 15));
    speed = 30 * s * s * (1 - s) * (1 - s) / duration;
  }
  double position = 0;  ///< 0..1
  double speed = 0;     ///< 1/s
};

}  // namespace poise
