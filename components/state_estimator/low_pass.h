// Second-order Butterworth low-pass of many signals at once, for steps of any length.
#pragma once

#include <Eigen/Core>

#include "components/framework/state_archive.h"

namespace poise {

/// H(s) = ω²/(s² + √2 ω s + ω²), integrated by the trapezoidal rule with the input held over the
/// step: stable for every step, unit gain at rest. Never allocates after construction.
class LowPass {
 public:
  /// `cutoff` Hz, > 0: −3 dB.
  LowPass(int num_signals, double cutoff);

  /// One step of `dt` s with `input`; the output is value().
  void Step(const Eigen::VectorXd& input, double dt);
  const Eigen::VectorXd& value() const { return value_; }
  /// The output's first derivative, 1/s of the signals.
  const Eigen::VectorXd& rate() const { return rate_; }
  /// Its second derivative, 1/s², the mean over the last step: at the step's end alone the input,
  /// held over the step, would be too old by half of it, an error of −ω² dt/2 times rate(). It is
  /// that of the last Step of this process, and not archived.
  const Eigen::VectorXd& curvature() const { return curvature_; }
  /// Rests at `input`.
  void Reset(const Eigen::VectorXd& input);
  void Archive(StateArchive* archive) { archive->Show(value_, rate_); }

 private:
  double omega_;
  Eigen::VectorXd value_, rate_, next_rate_, curvature_;
};

}  // namespace poise
