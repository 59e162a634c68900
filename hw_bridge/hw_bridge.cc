#include "hw_bridge/hw_bridge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "components/messages/robot_resource.h"
#include "hw_bridge/hw_bridge.pb.h"
#include "hw_bridge/simulated_drive_bus.h"
#include "hw_bridge/units.h"

namespace poise {
namespace {

void Require(bool condition, const char* field, const char* problem) {
  if (!condition) throw ConfigError(field, problem);
}

void Validate(const HwBridgeConfig& config) {
  Require(config.torque_limit_share() > 0 && config.torque_limit_share() <= 1, "torque_limit_share",
          "must be above 0 and at most 1");
  Require(config.damping_after_cycles() >= 0, "damping_after_cycles", "must not be negative");
  Require(config.stop_after_cycles() >= 0, "stop_after_cycles", "must not be negative");
  Require(config.damping() >= 0 && std::isfinite(config.damping()), "damping",
          "must be a finite number of N·m·s/rad, not negative");
  Require(config.stop_ramp() >= 0 && config.stop_ramp() <= 10, "stop_ramp",
          "must be between 0 and 10 s");
  Require(config.velocity_cutoff() > 0 && std::isfinite(config.velocity_cutoff()),
          "velocity_cutoff", "must be a finite number of Hz above 0");
}

SupervisorConfig MakeSupervisorConfig(const HwBridgeConfig& config, const robot::RobotModel& model,
                                      double period) {
  SupervisorConfig result;
  result.motors = model.motors();
  for (int j = 0; j < model.num_joints(); ++j) {
    const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
    const robot::MotorModel& motor = model.motors()[static_cast<size_t>(j)];
    const double limit = std::min(
        joint.effort, config.torque_limit_share() * JointTorque(motor, motor.peak_current));
    if (!(limit > 0) || !std::isfinite(limit)) {
      throw ConfigError(
          fmt::format("joint \"{}\": its torque limit is {} N·m; give the URDF's joint an effort "
                      "and its motor a "
                      "torque_constant and a peak_current above 0",
                      joint.name, limit));
    }
    if (motor.encoder_counts <= 0) {
      throw ConfigError(fmt::format(
          "joint \"{}\": its motor has no encoder_counts; give counts per motor revolution above 0",
          joint.name));
    }
    result.torque_limit.push_back(limit);
    result.velocity_limit.push_back(joint.velocity_limit);
  }
  result.num_feet = static_cast<int>(model.feet().size());
  result.period = period;
  result.damping_after_cycles = config.damping_after_cycles();
  result.stop_after_cycles = config.stop_after_cycles();
  result.damping = config.damping();
  result.stop_ramp = config.stop_ramp();
  result.velocity_cutoff = config.velocity_cutoff();
  return result;
}

}  // namespace

void HwBridge::Configure(const ComponentContext& context, Wiring* wiring) {
  const auto config = context.config<HwBridgeConfig>();
  Validate(config);
  const std::shared_ptr<const robot::RobotModel> shared_model = LoadRobot(context);
  const robot::RobotModel& model = *shared_model;
  const int n = model.num_joints();
  const int feet = static_cast<int>(model.feet().size());

  wiring->AddInput(&drive_feedback_, "drive_feedback", {n, feet});
  wiring->AddInput(&joint_command_, "joint_command", {n, feet});
  wiring->AddInput(&emergency_stop_, "emergency_stop", {}, InputKind::kLatest);
  wiring->AddOutput(&robot_sensors_, "robot_sensors", {n, feet});
  wiring->AddOutput(&drive_command_, "drive_command", {n});
  wiring->AddOutput(&bridge_status_, "bridge_status", {n});
  wiring->AddStage("sense", {&drive_feedback_}, {&robot_sensors_},
                   [this](const Tick& tick) { Sense(tick); });
  wiring->AddStage("actuate", {&joint_command_, &emergency_stop_},
                   {&drive_command_, &bridge_status_}, [this](const Tick& tick) { Actuate(tick); });

  motors_ = model.motors();
  supervisor_ =
      std::make_unique<Supervisor>(MakeSupervisorConfig(config, model, context.tick_period));
  bus_ = std::make_unique<SimulatedDriveBus>(&drive_feedback_, &drive_command_);
  MessageTraits<drive_command_t>::Resize(command_, MessageCounts{n});
}

void HwBridge::Sense(const Tick&) {
  const drive_feedback_t* feedback = bus_->Receive();
  if (feedback == nullptr) return;  // the message keeps the readings of the cycle before
  if (!run_known_) {
    supervisor_->SetRun(feedback->run_id);
    run_known_ = true;
  }
  if (!supervisor_->Read(*feedback)) return;  // likewise; the bridge has stopped

  robot_sensors_t& sensors = *robot_sensors_;
  for (size_t j = 0; j < motors_.size(); ++j) {
    sensors.joint_position[j] = JointPosition(motors_[j], feedback->position_counts[j]);
    sensors.joint_torque[j] = JointTorque(motors_[j], feedback->current[j]);
  }
  std::copy(std::begin(feedback->imu_angular_velocity), std::end(feedback->imu_angular_velocity),
            sensors.imu_angular_velocity);
  std::copy(std::begin(feedback->imu_acceleration), std::end(feedback->imu_acceleration),
            sensors.imu_acceleration);
  for (size_t f = 0; f < sensors.foot_wrench.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      // The sensor reports the environment on the robot.
      sensors.foot_wrench[f].force[i] = -feedback->foot_wrench[f].force[i];
      sensors.foot_wrench[f].moment[i] = -feedback->foot_wrench[f].moment[i];
    }
  }
}

void HwBridge::Actuate(const Tick& tick) {
  if (emergency_stop_.present() && emergency_stop_->stop != 0) supervisor_->EmergencyStop();
  supervisor_->Cycle(tick.index, joint_command_.present() ? &*joint_command_ : nullptr, &command_,
                     &*bridge_status_);
  bus_->Send(command_);
}

}  // namespace poise
