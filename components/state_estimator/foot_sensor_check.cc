#include "components/state_estimator/foot_sensor_check.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace poise {
namespace {

// s: no sensor with noise reads the same six numbers for so long, whatever they are. Zero is what a
// good one without noise reads in the air.
constexpr double kStuckTime = 0.1;
// s, in which what a reading swings by is forgotten to 1/e: longer than the slowest rattle that the
// observer's low-pass does not follow.
constexpr double kSwingTime = 0.1;
// Squared normalised difference of sensor and observer, chi-squared with 6 degrees of freedom: of a
// fault, far beyond chance (22 is one in a thousand), since the model's errors are no noise; of a
// fault whose reading does not change by a bit; and below which the two agree again.
constexpr double kFaultGate = 60, kFrozenGate = 20, kAgreeGate = 20;
// s that a disagreement lasts; without a change of a bit that make a reading frozen; and of
// agreement after which a sensor is believed again.
constexpr double kFaultTime = 0.05, kFrozenTime = 0.02, kRecoverTime = 1;

}  // namespace

void FootSensorCheck::Read(State said, const Wrench& measured, double dt) {
  said_ = said;
  same_time_ = measured == measured_ ? same_time_ + dt : 0;
  measured_ = measured;
  if (said != State::kOk) {
    state_ = said;
    wrong_time_ = right_time_ = same_time_ = 0;
    reads_ = false;
    return;
  }
  input_ = measured;
  if (reads_) {
    filter_.Step(input_, dt);
  } else {
    filter_.Reset(input_);
    above_.setZero();
    below_.setZero();
  }
  reads_ = true;
  const Wrench fast = measured - filter_.value();
  const double keep = std::exp(-dt / kSwingTime);
  above_ = (keep * above_).cwiseMax(fast);
  below_ = (keep * below_).cwiseMax(-fast);
}

void FootSensorCheck::Compare(const Wrench& observed, const Covariance& covariance,
                              const Wrench& noise, double least_force, double dt) {
  if (said_ != State::kOk) return;
  Covariance total = covariance;
  total.diagonal() += noise.cwiseAbs2();
  // Samples of what swings to both sides faster than the low-pass follows do not tell its mean: the
  // ground strikes between them. A fault steps to one side. A sensor that is not believed has to
  // agree by more than such a doubt.
  if (state_ == State::kOk) total.diagonal() += above_.cwiseMin(below_).cwiseAbs2();
  const Wrench gap = filter_.value() - observed;
  const double difference =
      gap.head<3>().norm() < least_force ? 0 : gap.dot(total.llt().solve(gap));
  if (!(difference >= 0)) return;  // not a covariance
  difference_ = difference;
  // What does not change by a bit has no noise: a little disagreement is then enough.
  const bool same = same_time_ >= kFrozenTime;
  const bool stuck = same_time_ >= kStuckTime && noise.minCoeff() > 0 && !measured_.isZero(0);
  const bool wrong = stuck || difference > (same ? kFrozenGate : kFaultGate);
  wrong_time_ = wrong ? wrong_time_ + dt : 0;
  right_time_ = !same && difference < kAgreeGate ? right_time_ + dt : 0;
  if (state_ == State::kOk) {
    if (wrong_time_ < (same ? kFrozenTime : kFaultTime)) return;
    state_ = !same ? State::kBiased : measured_.isZero(0) ? State::kDead : State::kFrozen;
    right_time_ = 0;
  } else if (right_time_ >= kRecoverTime) {
    state_ = State::kOk;
    wrong_time_ = 0;
  }
}

}  // namespace poise
