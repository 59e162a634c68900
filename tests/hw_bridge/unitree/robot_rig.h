// The whole bridge on a robot in memory, with every command that goes to it in view.
#pragma once

#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "components/messages/robot_resource.h"
#include "hw_bridge/ethercat/ethercat_drive_bus.h"
#include "hw_bridge/unitree/crc.h"
#include "hw_bridge/unitree/motor_slots.h"
#include "hw_bridge/unitree/unitree_drive_bus.h"
#include "tests/hw_bridge/bridge_bench.h"

namespace poise {

inline constexpr int kMotors = 12;

/// POISE_FUZZ_SAMPLES, or enough to look at every kind of mutation.
inline int FuzzSamples() {
  const char* const wanted = std::getenv("POISE_FUZZ_SAMPLES");
  return wanted != nullptr ? std::atoi(wanted) : 5000;
}

/// A robot that says what the test puts in `state`, once a cycle, and keeps what it is told.
struct RobotInMemory {
  unitree::LowState state{};
  unitree::LowCmd command{};
  int commands = 0;
  bool torque_seen = false;  // in any of them
  bool silent = false;
  bool own_crc = false;                         // the test has set crc
  const unitree::LowState* verbatim = nullptr;  // said in place of `state`, as it is
  std::vector<unitree::LowState> others;        // said by somebody else after each state
  std::string mode;                             // of the maker's controller
  bool answers = true, releases = true;
  int releases_asked = 0;
  bool fresh = false;
};

class MemoryRobotLink final : public unitree::RobotLink {
 public:
  explicit MemoryRobotLink(RobotInMemory* robot) : robot_(robot) {}
  int64_t Now() const override { return now_ += 1000; }
  bool Send(const unitree::LowCmd& command) override {
    robot_->command = command;
    ++robot_->commands;
    for (const unitree::MotorCmd& motor : command.motor_cmd) {
      robot_->torque_seen = robot_->torque_seen || motor.tau != 0 || motor.kp != 0;
    }
    return true;
  }
  bool Receive(unitree::LowState* state, int64_t deadline) override {
    if (robot_->silent || !std::exchange(robot_->fresh, false)) {
      if (next_other_ < robot_->others.size()) {
        *state = robot_->others[next_other_++];
        return true;
      }
      now_ = std::max(now_, deadline);
      return false;
    }
    next_other_ = 0;
    if (robot_->verbatim != nullptr) {
      *state = *robot_->verbatim;
      return true;
    }
    if (!robot_->own_crc) robot_->state.crc = unitree::CrcOf(robot_->state);
    *state = robot_->state;
    return true;
  }
  bool ReceiveTorsoImu(unitree::ImuState*) override { return false; }
  std::optional<std::string> ActiveMode(int64_t) override {
    return robot_->answers ? std::optional(robot_->mode) : std::nullopt;
  }
  bool Release(int64_t) override {
    ++robot_->releases_asked;
    if (robot_->releases) robot_->mode.clear();
    return robot_->releases;
  }

 private:
  RobotInMemory* robot_;
  mutable int64_t now_ = 0;
  size_t next_other_ = 0;
};

class RobotRig : public BridgeBench {
 public:
  explicit RobotRig(const std::string& config = "", const std::string& bus = "") {
    robot.state.mode_machine = 5;
    robot.state.imu_state.accelerometer[2] = 9.80665F;
    const ComponentContext context = Context("unitree { " + bus + " } " + config);
    model = LoadRobot(context);
    slots = unitree::MotorSlots(*model, unitree::UnitreeBusConfig::G1, {});
    for (size_t j = 0; j < kMotors; ++j) {
      unitree::MotorState& motor = robot.state.motor_state[slots[j]];
      motor.mode = 1;
      motor.temperature[0] = motor.temperature[1] = 40;
      motor.vol = 52;
      // Off their range's end.
      if (model->joints()[j].name.find("knee") != std::string::npos) motor.q = 0.6F;
    }
    const auto open = [this](const unitree::DdsLink&) {
      return std::make_unique<MemoryRobotLink>(&robot);
    };
    bridge = std::make_unique<HwBridge>(
        &signal, std::vector{unitree::UnitreeBusType(open), ethercat::EthercatBusType()});
    Configure(context, kMotors);
  }

  void Open() {
    NextState();
    bridge->Open();
  }
  /// One cycle. `speed`: every joint turns on, rad/s.
  void Step(bool with_command = true, double speed = 0, double lateness = 0) {
    for (size_t j = 0; j < kMotors; ++j) {
      state_of(j).q += static_cast<float>(speed * 0.002);
      Follow(j);
    }
    NextState();
    RunCycle(with_command, lateness);
  }
  void Run(int cycles) {
    for (int i = 0; i < cycles; ++i) Step();
  }
  /// Leads to RUNNING with `torque`, N·m, on every joint.
  void Start(double torque = 5) {
    Open();
    command.torque.assign(kMotors, torque);
    for (int i = 0; i < 100 && status().state != bridge_status_t::STATE_RUNNING; ++i) Step();
    Run(3);
  }
  /// Cycles until `condition` holds after the first: 0, the very next command shows it; -1: never.
  int CyclesUntil(const std::function<bool()>& condition, bool with_command = true,
                  double speed = 0, double lateness = 0) {
    return Count([&] { Step(with_command, speed, lateness); }, condition);
  }

  unitree::MotorState& state_of(size_t joint) { return robot.state.motor_state[slots[joint]]; }
  const unitree::MotorCmd& told(size_t joint) const {
    return robot.command.motor_cmd[slots[joint]];
  }
  /// N·m that a motor gives at what it says of itself.
  double TorqueOf(size_t joint) const {
    const unitree::MotorCmd& motor = told(joint);
    const unitree::MotorState& state = robot.state.motor_state[slots[joint]];
    if (motor.mode != 1) return 0;
    return static_cast<double>(motor.tau) +
           static_cast<double>(motor.kp) * static_cast<double>(motor.q - state.q) +
           static_cast<double>(motor.kd) * static_cast<double>(motor.dq - state.dq);
  }
  /// No torque but damping towards rest.
  bool AtRest() const {
    for (size_t j = 0; j < kMotors; ++j) {
      const unitree::MotorCmd& motor = told(j);
      if (motor.tau != 0 || motor.kp != 0 || motor.dq != 0) return false;
    }
    return true;
  }
  /// What of the last command is outside limits, in words; empty: nothing. Holds whatever the robot
  /// has said.
  std::string Broken() const {
    for (size_t j = 0; j < kMotors; ++j) {
      const unitree::MotorCmd& motor = told(j);
      const robot::MotorModel& known = model->motors()[j];
      const double peak = known.torque_per_ampere() * known.peak_current;
      if (!(std::abs(motor.tau) <= 2 * peak * 1.0001)) return "torque of " + std::to_string(j);
      if (!std::isfinite(motor.q) || !std::isfinite(motor.dq))
        return "goal of " + std::to_string(j);
      if (!(motor.kp >= 0 && motor.kp <= 1e5 && motor.kd >= 0 && motor.kd <= 1e4)) {
        return "impedance of " + std::to_string(j);
      }
      // At the last state that was whole the motor stays within its peak.
      if (!(std::abs(status().applied_torque[j]) <= peak * 1.0001)) {
        return "torque in all of " + std::to_string(j);
      }
    }
    return robot.command.crc == unitree::CrcOf(robot.command) ? "" : "check sum";
  }
  RobotInMemory robot;
  std::shared_ptr<const robot::RobotModel> model;
  std::vector<size_t> slots;
  bool motors_follow = true;  // their estimated torque is the commanded one
  bool motors_enable = true;  // as they are told; else they say that they are off

 private:
  void NextState() {
    for (size_t j = 0; j < kMotors; ++j) {
      if (!motors_enable) state_of(j).mode = 0;
    }
    robot.state.tick += 2;
    robot.fresh = true;
  }
  void Follow(size_t joint) {
    if (motors_follow) state_of(joint).tau_est = static_cast<float>(TorqueOf(joint));
  }
};

}  // namespace poise
