// HwBridge: between the controller's units and the drives, with the supervisor in between.
#pragma once

#include <memory>

#include "components/framework/component.h"
#include "components/robot/robot_model.h"
#include "hw_bridge/drive_bus.h"
#include "hw_bridge/supervisor.h"
#include "poise/emergency_stop_t.hpp"
#include "poise/robot_sensors_t.hpp"

namespace poise {

/// Stage "sense": drive_feedback → robot_sensors, in SI units, wrenches turned into robot on
/// environment. Stage "actuate": joint_command, emergency_stop (latest) → drive_command,
/// bridge_status.
class HwBridge : public Component {
 public:
  /// Resources "robot", "urdf"; configuration HwBridgeConfig.
  void Configure(const ComponentContext& context, Wiring* wiring) override;

 private:
  void Sense(const Tick& tick);
  void Actuate(const Tick& tick);

  Input<drive_feedback_t> drive_feedback_;
  Input<joint_command_t> joint_command_;
  Input<emergency_stop_t> emergency_stop_;
  Output<robot_sensors_t> robot_sensors_;
  Output<drive_command_t> drive_command_;
  Output<bridge_status_t> bridge_status_;

  std::unique_ptr<DriveBus> bus_;
  std::unique_ptr<Supervisor> supervisor_;
  std::vector<robot::MotorModel> motors_;
  drive_command_t command_;
  bool run_known_ = false;
};

}  // namespace poise
