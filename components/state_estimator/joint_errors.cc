#include "components/state_estimator/joint_errors.h"

#include <algorithm>

#include "components/state_estimator/square.h"

namespace poise {
namespace {

// s, within which a row's errors are one and the same: legs on gears ring at some 20 Hz.
constexpr double kCorrelationTime = 0.05;
// s, over which a free leg's errors are averaged; and while it may be pressed.
constexpr double kLearnTime = 0.5, kPressedLearnTime = 5;
// s, after which what was learnt is worth no more than what is assumed without.
constexpr double kForgetTime = 10;
// m/s, beyond which a sole does not stand: forty times what encoders leave of a standing one's.
constexpr double kFreeSpeed = 0.02;
// s, for which it must go so fast with no load: longer than the filter needs to show one.
constexpr double kFreeTime = 0.05;
// chi-squared with 6 degrees of freedom, exceeded once in a thousand times.
constexpr double kFreeExcess = 22.46;
// Standard deviations of the load at which it is free no longer, likewise.
constexpr double kFreePress = 3.1;

}  // namespace

JointErrors::JointErrors(size_t num_joints, const Torques& share)
    : share_(share), joint_(num_joints) {}

void JointErrors::Age(double dt) {
  for (Joint& joint : joint_) joint.age += dt;
}

void JointErrors::Learn(size_t joint, const Torques& torques, double residual, double variance,
                        bool pressed, double dt) {
  Joint& j = joint_[joint];
  j.learnt = std::min(j.learnt + dt, kLearnTime);
  j.age = 0;
  // The mean of all until there are enough of them.
  const double part = std::min(dt / (pressed ? kPressedLearnTime : j.learnt), 1.0);
  j.mean += part * (residual - j.mean);
  j.spread += part * (Square(residual - j.mean) - j.spread);
  j.offset += part * (Offset(torques, variance) - j.offset);
  for (size_t i = 0; i < torques.size(); ++i) j.torques[i] += part * (torques[i] - j.torques[i]);
}

// The part of a row's variance that is no share of its torques: friction on its way over.
double JointErrors::Offset(const Torques& torques, double variance) const {
  for (size_t i = 0; i < torques.size(); ++i) variance -= Square(share_[i] * torques[i]);
  return std::max(variance, 0.0);
}

// The conditional mean and variance of one normal number, given another that was seen.
JointErrors::Corrected JointErrors::Correct(size_t joint, const Torques& torques,
                                            double variance) const {
  const Joint& j = joint_[joint];
  if (!(j.learnt > 0)) return {0, variance};
  double seen = j.offset;
  double common = std::min(Offset(torques, variance), j.offset);
  common = std::max(common - Square(share_[0] * (torques[0] - j.torques[0])), 0.0);
  for (size_t i = 0; i < torques.size(); ++i) {
    const double then = j.torques[i];
    seen += Square(share_[i] * then);
    // Less than a share's own covariance is cautious: nothing is magnified, nor its sign changed.
    common += Square(share_[i]) * std::clamp(torques[i] * then, 0.0, then * then);
  }
  seen += j.spread + variance * (kCorrelationTime / j.learnt + j.age / kForgetTime);
  return {common / seen * j.mean, variance - common * common / seen};
}

bool FreeFoot::Update(double speed, double excess, double press, double dt) {
  moving_ = excess < kFreeExcess && speed > kFreeSpeed ? moving_ + dt : 0;
  const bool before = free_;
  free_ = press < kFreePress && (free_ || moving_ >= kFreeTime);
  return free_ && !before;
}

}  // namespace poise
