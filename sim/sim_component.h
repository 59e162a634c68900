// The simulated robot as a component: in the place of drives and sensors.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/component_type.h"
#include "components/framework/operator_acts.h"
#include "poise/bridge_status_t.hpp"
#include "poise/drive_command_t.hpp"
#include "poise/drive_feedback_t.hpp"
#include "poise/external_push_t.hpp"
#include "poise/ground_truth_t.hpp"
#include "sim/foot_sensors.h"
#include "sim/random.h"
#include "sim/sensors.h"
#include "sim/simulation.h"

namespace poise {

/// What an engine's process simulates, and in which world.
struct SimSetup {
  SimConfig sim;
  WorldFactory worlds;
};

/// Reads the configuration of an engine's process. Throws ConfigError.
using SimReader = std::function<SimSetup(const ComponentContext&)>;

/// The type of the process of `engine`: it takes the scenario's `sim` and the field of the engine's
/// name. The others: as in ComponentType.
ComponentType SimType(const std::string& engine, std::string summary, SimReader read,
                      const google::protobuf::Descriptor* config, std::string_view (*schema)());

/// drive_command and bridge_status of tick t - 1 -> one control period of simulation ->
/// drive_feedback, external_push and ground_truth of tick t. The crane, if there is one, lets go
/// when bridge_status says that the bridge follows. Tick 0 reports the start posture at rest
/// without stepping. Finishes, as failed, when the robot falls. A ConfigError's path begins with
/// "sim.": the configuration of an engine's process has a field `sim` (SimConfig) beside its own.
class SimComponent : public Component {
 public:
  explicit SimComponent(SimReader read);
  ~SimComponent() override;  // defined in the .cc: each engine would compile the ports anew
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  std::string_view finished() const override;
  bool failed() const override { return !finished().empty(); }
  /// For who runs the component in its own process; nullptr before Configure.
  Simulation* simulation() { return simulation_.get(); }

 private:
  void TakeActs(const Tick& tick);
  void Step(const Tick& tick);
  void PublishFeedback();
  void PublishPush();
  void PublishTruth();

  SimReader read_;
  Input<drive_command_t> drive_command_;
  Input<bridge_status_t> bridge_status_;
  ActInput operator_;
  Output<drive_feedback_t> drive_feedback_;
  Output<external_push_t> external_push_;
  Output<ground_truth_t> ground_truth_;
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<Sensors> sensors_;
  std::unique_ptr<FootSensors> foot_sensors_;
  std::unique_ptr<SensorReadings> readings_;
  double command_loss_ = 0;  // share of ticks
  std::optional<RandomStream> losses_;
  std::vector<int64_t> push_until_;        // by body: tick; -1: no push ends
  std::vector<DriveImpedance> impedance_;  // by joint
  std::vector<int8_t> current_sensor_;     // by joint
};

}  // namespace poise
