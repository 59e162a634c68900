// UnitreeEmulator: a Unitree robot's side of DDS on the motors of the simulated robot.
#pragma once

#include <cstdint>
#include <memory>

#include "components/framework/component_type.h"
#include "hw_bridge/unitree/dds.h"
#include "hw_bridge/unitree/motion_switcher.h"
#include "hw_bridge/unitree_emulator/emulated_robot.h"

namespace poise {

/// Stage "sense": drive_feedback (of the simulated robot) → rt/lowstate and rt/secondary_imu, and
/// sensor_feedback, which says that they have left. Stage "act": bridge_command says that rt/lowcmd
/// has left; what the robot makes of it → drive_command. The motion switcher answers until then.
class UnitreeEmulator final : public Component {
 public:
  UnitreeEmulator();
  ~UnitreeEmulator() override;

  /// Resources "robot", "urdf"; configuration UnitreeEmulatorConfig.
  void Configure(const ComponentContext& context, Wiring* wiring) override;
  void Open() override;
  void Idle() override;
  std::string Close() override;

 private:
  struct Ends;

  void Sense(const Tick& tick);
  void Act(const Tick& tick);
  void TakeCommands();
  void Publish();

  Input<drive_feedback_t> drive_feedback_;
  Input<drive_command_t> bridge_command_;
  Output<drive_feedback_t> sensor_feedback_;
  Output<drive_command_t> drive_command_;

  UnitreeEmulatorConfig config_;
  std::unique_ptr<unitree::EmulatedRobot> robot_;
  std::unique_ptr<Ends> ends_;
  drive_feedback_t last_feedback_;
  unitree::LowCmd command_{};
  uint32_t period_ = 0;  // ms, at least 1
  uint32_t time_ = 0;    // ms, of the last state
  uint32_t cycle_ = 0;   // of the run, from 1
  bool state_sent_ = false;
};

ComponentType UnitreeEmulatorType();

}  // namespace poise
