// Calibrator: what the robot carries beyond its model, found while it stands and sways slowly.
//
// The soles' wrenches tell the resultant that the ground exerts; the model tells what the motion
// asks for. What lies between is linear in four numbers, a mass and its moment (mass times place in
// the base frame): a load, or an error of the model's COM, which is a moment without mass. A Kalman
// filter of constant parameters with a slow walk. The moment along z, the COM's height, is
// considered and not estimated (Schmidt): standing tells it by a sway whose own errors are as
// large. docs/reference/estimation.md says what standing still, a sway, and neither can tell.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "components/framework/state_archive.h"
#include "components/state_estimator/low_pass.h"
#include "components/state_estimator/wrench_observer.h"

namespace poise {

class Calibrator {
 public:
  /// (mass, kg; moment x, y, z, kg·m).
  using Load = Eigen::Vector4d;

  /// `period`: s, of the ticks. The wrenches pass the observer's low-pass, as the model does.
  Calibrator(std::shared_ptr<const robot::RobotModel> model, bool enabled, double period);

  bool enabled() const { return enabled_; }
  /// Each tick, `dt` s after the last: the soles' wrenches, robot on environment, sole frames.
  void Track(const robot::FootArray<robot::Vector6d>& wrench, double dt);
  /// Follows what the observer has found in this tick, to which no load was told. `usable`: both
  /// wrenches are measured.
  void Update(const WrenchObserver& observer, bool usable);

  /// The load to be applied: the estimate, within bounds, reached smoothly.
  const Load& load() const { return applied_; }
  const Load& estimate() const { return estimate_; }
  const Eigen::Matrix4d& covariance() const { return covariance_; }
  /// Whether the last Update could learn: the robot stood.
  bool running() const { return running_; }
  void Archive(StateArchive* archive);

 private:
  void Correct(const Eigen::Matrix<double, 6, 4>& regressor, const robot::Vector6d& measured);

  std::shared_ptr<const robot::RobotModel> model_;
  bool enabled_;
  LowPass filter_;
  Eigen::VectorXd input_;
  double correlated_;  // samples that the filter makes one of
  Load estimate_ = Load::Zero(), applied_ = Load::Zero();
  Eigen::Matrix4d covariance_ = Eigen::Matrix4d::Zero();
  double since_ = 0;  // s, since the last correction
  bool running_ = false, started_ = false;
};

}  // namespace poise
