// StateEstimator: the estimated state of the floating-base robot from its sensors.
#pragma once

#include <memory>

#include "components/framework/component_type.h"
#include "components/state_estimator/calibrator.h"
#include "components/state_estimator/foot_wrenches.h"
#include "components/state_estimator/invariant_estimator.h"
#include "poise/estimator_status_t.hpp"
#include "poise/robot_sensors_t.hpp"
#include "poise/robot_state_t.hpp"

namespace poise {

/// Stage "estimate": robot_sensors → robot_state, estimator_status.
class StateEstimator : public Component {
 public:
  /// Resources "robot", "urdf"; configuration StateEstimatorConfig.
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  bool Archive(StateArchive* archive) override;

 private:
  void Estimate(const Tick& tick);
  ObserverCorrection Correction() const;
  void PublishWrenches();
  void PublishCalibration();
  void PublishBase();

  Input<robot_sensors_t> robot_sensors_;
  Output<robot_state_t> robot_state_;
  Output<estimator_status_t> estimator_status_;
  std::unique_ptr<InvariantEstimator> base_;
  std::unique_ptr<FootWrenches> wrenches_;
  std::unique_ptr<Calibrator> calibrator_;
  double last_time_ = 0;
};

ComponentType StateEstimatorType();

}  // namespace poise
