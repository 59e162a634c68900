// EmulatedRobot: the robot's side of states and commands, whatever carries them.
#pragma once

#include <cstdint>
#include <vector>

#include "components/robot/robot_model.h"
#include "hw_bridge/unitree/messages.h"
#include "hw_bridge/unitree_emulator/unitree_emulator.pb.h"
#include "poise/drive_command_t.hpp"
#include "poise/drive_feedback_t.hpp"

namespace poise::unitree {

/// Rounds to 32 bits, delays, checks and watches as a robot does. Never allocates after
/// construction.
class EmulatedRobot {
 public:
  /// `period`, s, of a cycle. Throws UnitreeError, ConfigError (paths inside the configuration).
  EmulatedRobot(const UnitreeEmulatorConfig& config, const robot::RobotModel& model, double period);

  /// Begins, goes on with and ends the troubles of this time, s.
  void SetTime(double time);
  /// The robot is somewhere else from the next state on, which comes without delay.
  void Place() { known_ = false; }
  /// What the robot says `tick` ms after its start, of what the motors report. nullptr: nothing.
  /// `cycle`: of the run, from 1, in simulated time; else 0.
  const LowState* State(const drive_feedback_t& feedback, uint32_t tick, uint32_t cycle = 0);
  const ImuState& torso_imu() const { return sent_.imu_state; }

  /// Takes a command that has come. False, and it is as if none had: wrong check sum, another
  /// mode_machine, something that is no number, a maker's controller.
  bool Take(const LowCmd& command);
  /// Ends a cycle: what the motors do in it, by joint (sized for the robot).
  void Act(drive_command_t* motors);

  /// A maker's controller moves the robot.
  void SetMakerActive(bool active) { maker_active_ = active; }
  /// Damps its motors for want of commands.
  bool damping() const { return silent_cycles_ > watchdog_cycles_; }
  int64_t refused() const { return refused_; }

 private:
  struct Trouble {
    UnitreeTrouble config;
    size_t slot = 0;
    uint16_t buttons = 0;
    bool active = false;
  };
  const Trouble* Find(UnitreeTrouble::Kind kind) const;
  void FillMotors(const drive_feedback_t& feedback);
  void ApplyTroubles();
  bool Fit(const LowCmd& command) const;

  UnitreeEmulatorConfig config_;
  std::vector<robot::MotorModel> motors_;  // by joint
  std::vector<size_t> slots_;
  std::vector<Trouble> troubles_;
  int64_t watchdog_cycles_;
  LowState now_{}, sent_{};
  std::vector<LowState> states_;  // by cycle, a ring of state_delay
  std::vector<LowCmd> commands_;  // likewise, of command_delay
  size_t next_state_ = 0, next_command_ = 0;
  LowCmd taken_{};
  bool maker_active_ = false, known_ = false;
  int64_t silent_cycles_ = 0, refused_ = 0;
};

}  // namespace poise::unitree
