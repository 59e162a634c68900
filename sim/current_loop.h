// From a drive's commanded current to the current that flows.
#pragma once

#include <cmath>

#include "sim/sim.pb.h"

namespace poise {

/// Rounding of the command and a first-order lag, solved exactly for a command held over a step.
class CurrentLoop {
 public:
  /// For steps of `h` s. The fields must be finite and not negative.
  CurrentLoop(const DriveTrain& config, double h) : resolution_(config.current_resolution()) {
    const double lag = config.torque_lag();
    if (lag <= 0) return;
    lags_ = true;
    keep_ = std::exp(-h / lag);
    mean_keep_ = -lag / h * std::expm1(-h / lag);
  }

  bool lags() const { return lags_; }
  /// The command (A) as the drive takes it.
  double Quantise(double command) const {
    return resolution_ > 0 ? resolution_ * std::round(command / resolution_) : command;
  }
  /// Mean current (A) of a step that starts with `*current`, which moves to the step's end.
  double Advance(double command, double* current) const {
    if (!lags_) return *current = command;
    const double gap = *current - command;
    *current = command + keep_ * gap;
    return command + mean_keep_ * gap;
  }

 private:
  double resolution_;
  bool lags_ = false;
  double keep_ = 0, mean_keep_ = 0;  // share of the gap that is left: at the end, on average
};

}  // namespace poise
