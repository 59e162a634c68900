// FootWrenches: what the feet carry, from their sensors where these are good, else as observed.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "components/framework/state_archive.h"
#include "components/state_estimator/foot_sensor_check.h"
#include "components/state_estimator/wrench_observer.h"

namespace poise {

struct FootReading {
  FootSensorCheck::State state = FootSensorCheck::State::kOk;  ///< as it says itself
  robot::Vector6d wrench = robot::Vector6d::Zero();            ///< robot on environment, sole frame
};

class FootWrenches {
 public:
  explicit FootWrenches(std::shared_ptr<const robot::RobotModel> model);

  /// Once a tick, `dt` s after the last. `correction`: what is known before this tick. Allocates
  /// nothing. Any finite input gives finite wrenches.
  void Update(int64_t tick, double dt, const BaseSensors& sensors,
              const robot::FootArray<FootReading>& reading, const ObserverCorrection& correction);

  /// Robot on environment, sole frame, and its standard deviations.
  const robot::Vector6d& wrench(robot::Foot foot) const { return wrench_[foot]; }
  const robot::Vector6d& deviation(robot::Foot foot) const { return deviation_[foot]; }
  /// Whether the foot's wrench is its sensor's; else it is observed.
  bool measured(robot::Foot foot) const { return check_[foot].good(); }
  const FootSensorCheck& check(robot::Foot foot) const { return check_[foot]; }
  const WrenchObserver& observer() const { return observer_; }
  /// Whether this tick's Update has observed.
  bool observed() const { return observed_; }
  void Archive(StateArchive* archive);

 private:
  void Compare();

  WrenchObserver observer_;
  double least_force_;
  robot::Vector6d noise_;
  robot::FootArray<FootSensorCheck> check_;
  robot::FootArray<robot::Vector6d> wrench_, deviation_;
  double since_ = 0;  // s, since the last observation
  bool observed_ = false;
};

}  // namespace poise
