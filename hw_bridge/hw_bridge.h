// HwBridge: between the controller's units and the drives, with the supervisor in between.
#pragma once

#include <csignal>
#include <functional>
#include <memory>

#include "components/framework/component.h"
#include "components/robot/robot_model.h"
#include "hw_bridge/drive/drive_bus.h"
#include "hw_bridge/ethercat/links/link.h"
#include "hw_bridge/ethercat/links/pcap.h"
#include "hw_bridge/hw_bridge.pb.h"
#include "hw_bridge/supervisor.h"
#include "hw_bridge/unitree/robot_link.h"
#include "poise/emergency_stop_t.hpp"
#include "poise/robot_sensors_t.hpp"

namespace poise {

/// Opens the configured EtherCAT link. Throws EthercatError.
using LinkOpener =
    std::function<std::unique_ptr<ethercat::Link>(const ethercat::LinkConfig& config)>;

/// Opens the link to a Unitree robot. Throws UnitreeError.
using RobotLinkOpener =
    std::function<std::unique_ptr<unitree::RobotLink>(const unitree::DdsLink& link)>;

/// Stage "sense": drive_feedback → robot_sensors, in SI units, wrenches turned into robot on
/// environment. Stage "actuate": joint_command, emergency_stop (latest) → drive_command,
/// bridge_status. With EtherCAT, counts, currents and states of the drives come from its frames and
/// drive_feedback gives the sensors that the bus has not; drive_command is then what the frames
/// order, and bus_status what each slave shows of itself. With a Unitree robot likewise, its IMU
/// included; drive_feedback is then a port of emulated robots alone.
class HwBridge : public Component {
 public:
  /// `stop_signal`: not 0 asks for an emergency stop, which takes it back to 0; may be nullptr.
  explicit HwBridge(volatile std::sig_atomic_t* stop_signal = nullptr);
  HwBridge(volatile std::sig_atomic_t* stop_signal, LinkOpener open_link,
           RobotLinkOpener open_robot = nullptr);
  ~HwBridge() override;

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
  class Ethercat;
  class Unitree;

  /// The drives are beyond a bus of their own, which Open opens.
  bool has_bus() const { return ethercat_ || unitree_; }
  void AddPorts(const HwBridgeConfig& config, Wiring* wiring);
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
  LinkOpener open_link_;
  RobotLinkOpener open_robot_;
  std::shared_ptr<const robot::RobotModel> model_;
  std::unique_ptr<Ethercat> ethercat_;  // configuration, and the open link
  std::unique_ptr<Unitree> unitree_;    // likewise
  std::unique_ptr<DriveBus> bus_;       // one of its own once it is open
  std::unique_ptr<Supervisor> supervisor_;
  drive_command_t command_;
  drive_feedback_t feedback_;
  bool simulated_time_ = true, enable_at_start_ = false, open_ = false;
  int enable_cycles_ = 0;
  bool reset_before_ = false;  // of the operator's message
  int64_t last_cycle_ = -1;
};

}  // namespace poise
