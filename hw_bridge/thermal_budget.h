// ThermalBudget: how long a motor may carry more than its rated current (I²t).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace poise {

/// Heat is the share of what the motor bears above its rating: it grows with (i/i_rated)² − 1 and
/// reaches 1 after `peak_time` at the peak current.
class ThermalBudget {
 public:
  /// A, A, s. Without a rated current, or with a peak that is not above it, nothing is limited.
  ThermalBudget(double rated_current, double peak_current, double peak_time)
      : rated_(rated_current) {
    const double peak = rated_current > 0 ? peak_current / rated_current : 0;
    budget_ = peak > 1 ? (peak * peak - 1) * peak_time : 0;
  }

  /// Greatest current, A, allowed in the next cycle. Falls from where the budget would be used up
  /// within kSoftTime to the rated current, so that the limit is approached without a step.
  double CurrentLimit() const {
    if (budget_ <= 0) return std::numeric_limits<double>::infinity();
    return rated_ * std::sqrt(1 + (1 - heat_) * budget_ / kSoftTime);
  }
  /// Lets `seconds` pass with `current`, A.
  void Advance(double current, double seconds) {
    if (budget_ <= 0) return;
    const double share = current / rated_;
    heat_ = std::clamp(heat_ + (share * share - 1) * seconds / budget_, 0.0, 1.0);
  }
  double heat() const { return heat_; }

 private:
  static constexpr double kSoftTime = 0.1;  // s
  double rated_;
  double budget_ = 0;  // s, of squared per unit above 1
  double heat_ = 0;
};

}  // namespace poise
