#include "hw_bridge/unitree_emulator/emulated_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "hw_bridge/drive/units.h"
#include "hw_bridge/unitree/crc.h"
#include "hw_bridge/unitree/motor_slots.h"
#include "hw_bridge/unitree/remote.h"

namespace poise::unitree {
namespace {

constexpr int16_t kTemperature = 45;   // °C of all motors
constexpr float kVoltage = 52;         // V of all motors
constexpr float kWatchdogDamping = 8;  // N·m·s/rad, what the makers' examples damp with

bool AllFinite(const MotorCmd& motor) {
  return std::isfinite(motor.q + motor.dq + motor.tau + motor.kp + motor.kd);
}

}  // namespace

EmulatedRobot::EmulatedRobot(const UnitreeEmulatorConfig& config, const robot::RobotModel& model,
                             double period)
    : config_(config),
      motors_(model.motors()),
      slots_(MotorSlots(model, config.layout(), config.slot())),
      watchdog_cycles_(std::llround(config.watchdog() / period)) {
  CheckFields(config);
  for (int i = 0; i < config.trouble_size(); ++i) {
    Trouble& trouble = troubles_.emplace_back();
    trouble.config = config.trouble(i);
    trouble.buttons = ButtonsOf({trouble.config.button().begin(), trouble.config.button().end()});
    const auto kind = trouble.config.kind();
    if (kind == UnitreeTrouble::BUTTON && trouble.buttons == 0) {
      throw ConfigError(fmt::format("trouble[{}].button", i),
                        "must name the buttons that are pressed, e.g. button[0]=B");
    }
    if (kind != UnitreeTrouble::HOT_MOTOR && kind != UnitreeTrouble::MOTOR_ERROR) continue;
    const int joint = model.FindJoint(trouble.config.joint());
    if (joint < 0) {
      throw ConfigError(
          fmt::format("trouble[{}].joint", i),
          fmt::format("must be a joint of the robot, not \"{}\"", trouble.config.joint()));
    }
    trouble.slot = slots_[static_cast<size_t>(joint)];
  }
  states_.resize(config.state_delay() + 1);
  commands_.resize(config.command_delay() + 1);
}

void EmulatedRobot::SetTime(double time) {
  for (Trouble& trouble : troubles_) {
    const UnitreeTrouble& config = trouble.config;
    trouble.active = time >= config.from() && !(config.has_until() && time >= config.until());
  }
}

const EmulatedRobot::Trouble* EmulatedRobot::Find(UnitreeTrouble::Kind kind) const {
  const auto found = std::find_if(troubles_.begin(), troubles_.end(), [kind](const Trouble& t) {
    return t.active && t.config.kind() == kind;
  });
  return found == troubles_.end() ? nullptr : &*found;
}

void EmulatedRobot::FillMotors(const drive_feedback_t& feedback) {
  for (size_t j = 0; j < slots_.size(); ++j) {
    MotorState& motor = now_.motor_state[slots_[j]];
    motor.q = static_cast<float>(JointPositionOf(motors_[j], feedback.position_counts[j]));
    motor.dq = static_cast<float>(feedback.velocity[j]);
    motor.tau_est = static_cast<float>(JointTorque(motors_[j], feedback.current[j]));
    motor.mode = taken_.motor_cmd[slots_[j]].mode;
    motor.temperature[0] = motor.temperature[1] = kTemperature;
    motor.vol = kVoltage;
    motor.motorstate = 0;
  }
  known_ = true;
  for (size_t i = 0; i < 3; ++i) {
    now_.imu_state.gyroscope[i] = static_cast<float>(feedback.imu_angular_velocity[i]);
    now_.imu_state.accelerometer[i] = static_cast<float>(feedback.imu_acceleration[i]);
  }
  for (size_t i = 0; i < 4; ++i) {
    now_.imu_state.quaternion[i] = static_cast<float>(feedback.imu_orientation[i]);
  }
}

/// Troubles change the state that leaves.
void EmulatedRobot::ApplyTroubles() {
  uint16_t buttons = 0;
  for (const Trouble& trouble : troubles_) {
    if (!trouble.active) continue;
    const double value = trouble.config.value();
    switch (trouble.config.kind()) {
      case UnitreeTrouble::BUTTON:
        buttons = static_cast<uint16_t>(buttons | trouble.buttons);
        break;
      case UnitreeTrouble::HOT_MOTOR:
        sent_.motor_state[trouble.slot].temperature[1] =
            static_cast<int16_t>(std::clamp(value, -300.0, 3000.0));
        break;
      case UnitreeTrouble::LOW_VOLTAGE:
        for (const size_t slot : slots_) sent_.motor_state[slot].vol = static_cast<float>(value);
        break;
      case UnitreeTrouble::MOTOR_ERROR:
        sent_.motor_state[trouble.slot].motorstate =
            static_cast<uint32_t>(std::clamp(value, 1.0, 1e9));
        break;
      case UnitreeTrouble::MAKER_TAKES_OVER:
        sent_.mode_machine = static_cast<uint8_t>(config_.mode_machine() + 1);
        break;
      default:
        break;
    }
  }
  SetButtons(buttons, sent_.wireless_remote);
  sent_.crc = CrcOf(sent_);
  if (Find(UnitreeTrouble::BAD_CRC) != nullptr) sent_.motor_state[slots_[0]].q += 1;
}

const LowState* EmulatedRobot::State(const drive_feedback_t& feedback, uint32_t tick,
                                     uint32_t cycle) {
  now_.mode_machine = static_cast<uint8_t>(config_.mode_machine());
  const bool first = !known_;
  FillMotors(feedback);
  if (first) std::fill(states_.begin(), states_.end(), now_);
  states_[next_state_] = now_;
  next_state_ = (next_state_ + 1) % states_.size();
  sent_ = states_[next_state_];  // the oldest
  sent_.mode_machine = now_.mode_machine;
  sent_.tick = tick;
  sent_.reserve[0] = cycle;
  ApplyTroubles();
  return Find(UnitreeTrouble::NO_STATE) != nullptr ? nullptr : &sent_;
}

bool EmulatedRobot::Fit(const LowCmd& command) const {
  return command.crc == CrcOf(command) && command.mode_machine == config_.mode_machine() &&
         !maker_active_ && Find(UnitreeTrouble::MAKER_TAKES_OVER) == nullptr &&
         std::all_of(std::begin(command.motor_cmd), std::end(command.motor_cmd), AllFinite);
}

bool EmulatedRobot::Take(const LowCmd& command) {
  if (Find(UnitreeTrouble::NO_COMMAND) != nullptr) return false;
  if (!Fit(command)) {
    ++refused_;
    return false;
  }
  taken_ = command;
  silent_cycles_ = -1;  // of the cycle that ends next
  return true;
}

void EmulatedRobot::Act(drive_command_t* motors) {
  ++silent_cycles_;
  commands_[next_command_] = taken_;
  next_command_ = (next_command_ + 1) % commands_.size();
  const LowCmd& command = commands_[next_command_];  // the oldest
  for (size_t j = 0; j < slots_.size(); ++j) {
    MotorCmd motor = command.motor_cmd[slots_[j]];
    if (damping()) {
      motor = {};
      motor.mode = kMotorEnabled;
      motor.kd = kWatchdogDamping;
    }
    const Trouble* error = Find(UnitreeTrouble::MOTOR_ERROR);
    const bool enabled =
        motor.mode == kMotorEnabled && !(error != nullptr && error->slot == slots_[j]);
    motors->enabled[j] = enabled ? 1 : 0;
    motors->current[j] = enabled ? MotorCurrent(motors_[j], static_cast<double>(motor.tau)) : 0.0;
    motors->position[j] = static_cast<double>(motor.q);
    motors->velocity[j] = static_cast<double>(motor.dq);
    motors->stiffness[j] = enabled ? std::max(0.0, static_cast<double>(motor.kp)) : 0.0;
    motors->damping[j] = enabled ? std::max(0.0, static_cast<double>(motor.kd)) : 0.0;
  }
}

}  // namespace poise::unitree
