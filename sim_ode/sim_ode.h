// The simulated robot as a component: in the place of drives and sensors.
#pragma once

#include <memory>

#include "components/framework/component.h"
#include "poise/bridge_status_t.hpp"
#include "poise/drive_command_t.hpp"
#include "poise/drive_feedback_t.hpp"
#include "poise/external_push_t.hpp"
#include "poise/ground_truth_t.hpp"
#include "sim_ode/sensors.h"
#include "sim_ode/simulation.h"

namespace poise {

/// drive_command and bridge_status of tick t - 1 -> one control period of simulation ->
/// drive_feedback, external_push and ground_truth of tick t. The crane, if there is one, lets go
/// when bridge_status says that the bridge follows. Tick 0 reports the start posture at rest
/// without stepping. Finishes, as failed, when the robot falls.
class SimOde : public Component {
 public:
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  std::string_view finished() const override;
  bool failed() const override { return !finished().empty(); }

 private:
  void Step(const Tick& tick);
  void PublishFeedback();
  void PublishPush();
  void PublishTruth();

  Input<drive_command_t> drive_command_;
  Input<bridge_status_t> bridge_status_;
  Output<drive_feedback_t> drive_feedback_;
  Output<external_push_t> external_push_;
  Output<ground_truth_t> ground_truth_;
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<Sensors> sensors_;
  std::unique_ptr<SensorReadings> readings_;
};

}  // namespace poise
