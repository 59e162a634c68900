// FootSensorCheck: whether a foot's six-axis sensor is to be believed, by comparison with what is
// observed without it. The reading passes the observer's low-pass first: of a sole that rattles on
// the ground the reading itself jumps by more than the weight, and the observer tells a mean.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "components/framework/state_archive.h"
#include "components/state_estimator/low_pass.h"
#include "components/state_estimator/wrench_observer.h"

namespace poise {

class FootSensorCheck {
 public:
  using Wrench = Eigen::Matrix<double, 6, 1>;
  using Covariance = Eigen::Matrix<double, 6, 6>;
  enum class State : int8_t { kOk, kAbsent, kInvalid, kDead, kFrozen, kBiased };

  /// Once a tick, `dt` s after the last: what the sensor says of itself (kOk, kAbsent or kInvalid)
  /// and what it reads.
  void Read(State said, const Wrench& measured, double dt);
  /// Compares with what is observed, `dt` s after the last comparison. `noise`: standard deviations
  /// of the reading. Forces that differ by less than `least_force`, N, agree.
  void Compare(const Wrench& observed, const Covariance& covariance, const Wrench& noise,
               double least_force, double dt);

  State state() const { return state_; }
  bool good() const { return state_ == State::kOk; }
  /// Squared normalised difference at the last comparison: chi-squared with 6 degrees of freedom.
  double difference() const { return difference_; }
  void Archive(StateArchive* archive) {
    archive->Show(state_, said_, measured_, same_time_, wrong_time_, right_time_, difference_);
    archive->Show(reads_, above_, below_);
    filter_.Archive(archive);
  }

 private:
  State state_ = State::kOk, said_ = State::kOk;
  Wrench measured_ = Wrench::Zero();
  LowPass filter_{6, kObserverCutoff};
  Eigen::VectorXd input_ = Wrench::Zero();  // of filter_
  bool reads_ = false;                      // the last tick had a reading
  // How far the reading went beyond its low-passed value to either side, fading.
  Wrench above_ = Wrench::Zero(), below_ = Wrench::Zero();
  double same_time_ = 0;                    // s, for which not a bit has changed
  double wrong_time_ = 0, right_time_ = 0;  // s, for which it has disagreed, agreed
  double difference_ = 0;
};

}  // namespace poise
