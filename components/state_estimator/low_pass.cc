#include "components/state_estimator/low_pass.h"

#include <numbers>

namespace poise {

LowPass::LowPass(int num_signals, double cutoff)
    : omega_(2 * std::numbers::pi * cutoff),
      value_(Eigen::VectorXd::Zero(num_signals)),
      rate_(Eigen::VectorXd::Zero(num_signals)),
      next_rate_(Eigen::VectorXd::Zero(num_signals)),
      curvature_(Eigen::VectorXd::Zero(num_signals)) {}

void LowPass::Step(const Eigen::VectorXd& input, double dt) {
  // value' = rate, rate' = ω² (input − value) − √2 ω rate; both means over the step solved for the
  // end of the step.
  const double h = dt / 2;
  const double damping = h * std::numbers::sqrt2 * omega_;
  const double stiffness = h * h * omega_ * omega_;
  const double scale = 1 / (1 + damping + stiffness);
  next_rate_ =
      scale * ((1 - damping - stiffness) * rate_ + 2 * h * omega_ * omega_ * (input - value_));
  value_ += h * (rate_ + next_rate_);
  if (dt > 0) curvature_ = (next_rate_ - rate_) / dt;
  rate_ = next_rate_;
}

void LowPass::Reset(const Eigen::VectorXd& input) {
  value_ = input;
  rate_.setZero();
  curvature_.setZero();
}

}  // namespace poise
