// A bridge of three unlike joints and the messages around it.
#pragma once

#include <array>
#include <limits>

#include "hw_bridge/drive/units.h"
#include "hw_bridge/supervisor.h"
#include "poise/message_traits.hpp"

namespace poise {

inline constexpr int kJoints = 3;
inline constexpr int64_t kRun = 7;
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

inline SupervisorConfig ThreeJoints() {
  SupervisorConfig config;
  // Limit of joint 0: the URDF's effort; of joint 1: the peak current (50·0.1·30 = 150 N·m); of
  // joint 2: its small motor.
  const std::array<double, kJoints> gear{50, 50, 100}, constant{0.1, 0.1, 0.05}, peak{30, 30, 4},
      limit{100, 400, 90};
  for (size_t j = 0; j < kJoints; ++j) {
    robot::MotorModel motor;
    motor.gear_ratio = gear[j];
    motor.torque_constant = constant[j];
    motor.peak_current = peak[j];
    motor.encoder_counts = 8192;
    config.motors.push_back(motor);
    config.torque_limit.push_back(limit[j]);
  }
  config.period = 0.002;
  // A test gives the limits that it is about; what is not given here is as it is shipped.
  config.settings.set_velocity_trip(kInfinity);
  config.settings.set_tilt_limit(kInfinity);
  config.start_velocity = kInfinity;
  config.resume_time = 0;
  config.settings.set_enable_cycles(2);
  config.stop_after_cycles = 13;
  config.thresholds.slew_limit = kInfinity;
  config.thresholds.frozen_torque = kInfinity;
  config.thresholds.torque_error = kInfinity;
  config.thresholds.damping.assign(config.motors.size(), 20);
  config.lower.assign(config.motors.size(), -kInfinity);
  for (std::vector<double>* limit :
       {&config.upper, &config.velocity_limit, &config.thresholds.stiffness_limit,
        &config.thresholds.damping_limit}) {
    limit->assign(config.motors.size(), kInfinity);
  }
  return config;
}

/// What the limits of ThreeJoints amount to, A.
inline constexpr std::array<double, kJoints> kCurrentLimit{20, 30, 4};

inline drive_feedback_t Feedback() {
  drive_feedback_t feedback;
  MessageTraits<drive_feedback_t>::Resize(feedback, std::array<int32_t, 2>{kJoints, 2});
  feedback.run_id = kRun;
  feedback.drive_status.assign(kJoints, drive_feedback_t::DRIVE_ENABLED);
  return feedback;
}

inline joint_command_t Command(int64_t tick, double torque) {
  joint_command_t command;
  MessageTraits<joint_command_t>::Resize(command, std::array<int32_t, 2>{kJoints, 2});
  command.run_id = kRun;
  command.tick = tick;
  command.torque.assign(kJoints, torque);
  return command;
}

/// Drives the supervisor cycle by cycle with a joint motion of constant velocity.
class Bench {
 public:
  explicit Bench(SupervisorConfig config = ThreeJoints())
      : config_(config), supervisor_(config), feedback_(Feedback()) {
    supervisor_.SetRun(kRun);
    MessageTraits<drive_command_t>::Resize(drives_, std::array<int32_t, 1>{kJoints});
    MessageTraits<bridge_status_t>::Resize(status_, std::array<int32_t, 1>{kJoints});
  }

  /// Feedback of the next cycle: all joints turn on at `velocity`, rad/s.
  drive_feedback_t& Turn(double velocity) {
    position_ += velocity * config_.period;
    for (size_t j = 0; j < kJoints; ++j) {
      feedback_.position_counts[j] = EncoderCounts(config_.motors[j], position_);
    }
    return feedback_;
  }

  /// One cycle with feedback and, unless nullptr, a command.
  void Step(const joint_command_t* command, double velocity = 0) {
    supervisor_.Read(Turn(velocity));
    End(command);
  }
  void Step(double torque, double velocity = 0) {
    const joint_command_t command = Command(cycle_, torque);
    Step(&command, velocity);
  }
  void End(const joint_command_t* command) {
    supervisor_.Cycle(cycle_, command, &drives_, &status_);
    ++cycle_;
  }
  /// Commands `torque` for `cycles` cycles while the joints turn.
  void Run(int cycles, double torque, double velocity) {
    for (int i = 0; i < cycles; ++i) Step(torque, velocity);
  }

  Supervisor& supervisor() { return supervisor_; }
  drive_feedback_t& feedback() { return feedback_; }
  const drive_command_t& drives() const { return drives_; }
  const bridge_status_t& status() const { return status_; }
  int64_t cycle() const { return cycle_; }
  bool AllFree() const {
    for (size_t j = 0; j < kJoints; ++j) {
      if (drives_.current[j] != 0 || drives_.enabled[j] != 0) return false;
    }
    return true;
  }

 private:
  SupervisorConfig config_;
  Supervisor supervisor_;
  drive_feedback_t feedback_;
  drive_command_t drives_;
  bridge_status_t status_;
  double position_ = 0;
  int64_t cycle_ = 0;
};

}  // namespace poise
