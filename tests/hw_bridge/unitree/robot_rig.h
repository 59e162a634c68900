// The whole bridge on a robot in memory, with every command that goes to it in view.
#pragma once

#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

#include "components/messages/robot_resource.h"
#include "hw_bridge/ethercat/links/socket_link.h"
#include "hw_bridge/hw_bridge.h"
#include "hw_bridge/unitree/crc.h"
#include "hw_bridge/unitree/motor_slots.h"

namespace poise {

inline constexpr int kMotors = 12;

inline std::string ReadDeployed(const std::string& name) {
  std::ifstream file(std::string(POISE_SOURCE_DIR "/deploy/") + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// A robot that says what the test puts in `state`, once a cycle, and keeps what it is told.
struct RobotInMemory {
  unitree::LowState state{};
  unitree::LowCmd command{};
  int commands = 0;
  bool silent = false;
  bool own_crc = false;  // the test has set crc
  std::string mode;      // of the maker's controller
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
    return true;
  }
  bool Receive(unitree::LowState* state, int64_t deadline) override {
    if (robot_->silent || !std::exchange(robot_->fresh, false)) {
      now_ = std::max(now_, deadline);
      return false;
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
};

class RobotRig {
 public:
  explicit RobotRig(const std::string& config = "", const std::string& bus = "") {
    robot.state.mode_machine = 5;
    robot.state.imu_state.accelerometer[2] = 9.80665F;
    resources_ = {{"robot", ReadDeployed("robots/dyros/dyros_legs.pbtxt")},
                  {"urdf", ReadDeployed("robots/dyros/dyros_legs.urdf")}};
    ComponentContext context;
    context.name = "hw_bridge";
    context.config_text = "unitree { " + bus + " } " + config;
    context.tick_period = 0.002;
    context.resources = &resources_;
    context.shared = &shared_;
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
    bridge = std::make_unique<HwBridge>(
        &signal, ethercat::OpenLink,
        [this](const unitree::DdsLink&) { return std::make_unique<MemoryRobotLink>(&robot); });
    MessageTraits<joint_command_t>::Resize(command, MessageCounts{kMotors, 2});
    command.run_id = stop.run_id = kRunId;
    bridge->Configure(context, &wiring_);
  }

  void Open() {
    NextState();
    bridge->Open();
  }
  void Step(bool with_command = true, double speed = 0) {
    for (size_t j = 0; j < kMotors; ++j) {
      robot.state.motor_state[slots[j]].q += static_cast<float>(speed * 0.002);
      Follow(j);
    }
    NextState();
    command.tick = tick_;
    command.utime = 2000 * tick_;
    Port("joint_command")->Bind(with_command ? &command : nullptr);
    Port("emergency_stop")->Bind(stop.stop != 0 || stop.reset != 0 || stop_seen_ ? &stop : nullptr);
    stop_seen_ = stop_seen_ || stop.stop != 0;
    const Tick tick{.index = tick_, .utime = 2000 * tick_, .time = 0, .lateness = 0};
    for (const Stage& stage : wiring_.stages()) {
      for (OutputPort* output : stage.outputs) output->Stamp(kRunId, tick.index, tick.utime);
      stage.run(tick);
      for (OutputPort* output : stage.outputs) static_cast<void>(output->TakeWithheld());
    }
    ++tick_;
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
  int CyclesUntil(const std::function<bool()>& condition, bool with_command = true) {
    for (int cycles = 0; cycles < 2000; ++cycles) {
      Step(with_command);
      if (condition()) return cycles;
    }
    return -1;
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
  const bridge_status_t& status() const {
    return *static_cast<const bridge_status_t*>(Find("bridge_status")->message());
  }
  const bus_status_t& bus_status() const {
    return *static_cast<const bus_status_t*>(Find("bus_status")->message());
  }
  const robot_sensors_t& readings() const {
    return *static_cast<const robot_sensors_t*>(Find("robot_sensors")->message());
  }
  bool HasInput(const std::string& name) const {
    for (InputPort* input : wiring_.inputs()) {
      if (input->name() == name) return true;
    }
    return false;
  }

  static constexpr int64_t kRunId = 5;
  volatile std::sig_atomic_t signal = 0;
  RobotInMemory robot;
  std::shared_ptr<const robot::RobotModel> model;
  std::vector<size_t> slots;
  std::unique_ptr<HwBridge> bridge;
  joint_command_t command;
  emergency_stop_t stop{};
  bool motors_follow = true;  // their estimated torque is the commanded one

 private:
  void NextState() {
    robot.state.tick += 2;
    robot.fresh = true;
  }
  void Follow(size_t joint) {
    if (motors_follow) state_of(joint).tau_est = static_cast<float>(TorqueOf(joint));
  }
  InputPort* Port(const std::string& name) const {
    for (InputPort* input : wiring_.inputs()) {
      if (input->name() == name) return input;
    }
    throw std::logic_error("no input " + name);
  }
  OutputPort* Find(const std::string& name) const {
    for (OutputPort* output : wiring_.outputs()) {
      if (output->name() == name) return output;
    }
    throw std::logic_error("no output " + name);
  }

  std::map<std::string, std::string> resources_;
  SharedObjects shared_;
  Wiring wiring_;
  int64_t tick_ = 0;
  bool stop_seen_ = false;
};

}  // namespace poise
