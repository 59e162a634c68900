// HwBridge: between the controller's units and the drives, with the supervisor in between.
#pragma once

#include <csignal>
#include <memory>
#include <vector>

#include "components/framework/component_type.h"
#include "components/robot/robot_model.h"
#include "hw_bridge/drive_buses.h"
#include "hw_bridge/hw_bridge.pb.h"
#include "hw_bridge/supervisor.h"
#include "poise/emergency_stop_t.hpp"
#include "poise/robot_sensors_t.hpp"

namespace poise {

/// The drive bus of the simulated robot: two ports of the graph.
class SimulatedDriveBus final : public DriveBus {
 public:
  /// `feedback` must outlive the bus.
  explicit SimulatedDriveBus(const Input<drive_feedback_t>* feedback) : feedback_(feedback) {}

  const drive_feedback_t* Receive() override {
    return feedback_->present() ? &**feedback_ : nullptr;
  }
  /// The message that the bridge publishes is the command.
  void Send(const drive_command_t&) override {}
  bool impedance() const override { return true; }
  SensorsOfBus sensors() const override { return {.velocity = true}; }
  const BusHealth& health() const override { return health_; }

 private:
  const Input<drive_feedback_t>* feedback_;
  BusHealth health_;
};

/// Stage "sense": drive_feedback → robot_sensors, in SI units, wrenches turned into robot on
/// environment. Stage "actuate": joint_command, emergency_stop (latest) → drive_command,
/// bridge_status. With a bus of its own (DriveBusType), counts, currents and states of the drives
/// come from it and drive_feedback gives the sensors that the bus has not; drive_command is then
/// what the bus orders, and bus_status what each slave shows of itself.
class HwBridge : public Component {
 public:
  /// `stop_signal`: not 0 asks for an emergency stop, which takes it back to 0; may be nullptr.
  /// `buses`: of which a configuration may ask for one.
  explicit HwBridge(volatile std::sig_atomic_t* stop_signal = nullptr,
                    std::vector<DriveBusType> buses = DriveBuses())
      : stop_signal_(stop_signal), buses_(std::move(buses)) {}

  /// Resources "robot", "urdf"; configuration HwBridgeConfig.
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  /// Leads the drives to where they take commands, without torque, and enables them if that is to
  /// be done at the start.
  void Open() override;
  /// Before the first cycle an exchange without torque; after the last, a cycle of the way down.
  void Idle() override;
  /// Ramps torque out, disables the drives and leads them to INIT.
  std::string Close() override;
  int64_t cycle_correction() const override { return bus_ ? bus_->cycle_correction() : 0; }

 private:
  /// The bus that the configuration asks for.
  void MakeBus(double period);
  void AddPorts(Wiring* wiring);
  void Sense(const Tick& tick);
  void ReadFootSensors(const drive_feedback_t& feedback);
  void Actuate(const Tick& tick);
  /// Feedback of this cycle with all sensors that have come; nullptr when the drives' has not.
  const drive_feedback_t* ReadFeedback();
  void CheckOperator();
  /// Waits until all drives are enabled. Throws std::runtime_error naming one that is not.
  void EnableDrives();
  /// A cycle without ports, on the way to rest.
  void RunDown();

  Input<drive_feedback_t> drive_feedback_;
  Input<joint_command_t> joint_command_;
  Input<emergency_stop_t> emergency_stop_;
  Output<robot_sensors_t> robot_sensors_;
  Output<drive_command_t> drive_command_;
  Output<bridge_status_t> bridge_status_;
  Output<bus_status_t> bus_status_;  // with a bus of its own

  volatile std::sig_atomic_t* stop_signal_;
  std::vector<DriveBusType> buses_;
  std::shared_ptr<const robot::RobotModel> model_;
  SimulatedDriveBus simulated_bus_{&drive_feedback_};
  std::unique_ptr<DriveBus> own_bus_;
  DriveBus* bus_ = nullptr;  // one of the two; the own one from Open on
  std::unique_ptr<Supervisor> supervisor_;
  drive_feedback_t feedback_;
  HwBridgeConfig config_;
  bool simulated_time_ = true, open_ = false;
  bool all_sensors_ = false;   // are the own bus's
  bool reset_before_ = false;  // of the operator's message
  int64_t last_cycle_ = -1;
};

/// `stop_signal` (may be nullptr): once it is not 0, the bridge stops as on EMERGENCY_STOP.
ComponentType HwBridgeType(volatile std::sig_atomic_t* stop_signal = nullptr);

}  // namespace poise
