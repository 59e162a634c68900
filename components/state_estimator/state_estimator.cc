#include "components/state_estimator/state_estimator.h"

#include <algorithm>
#include <cmath>

#include "components/messages/robot_resource.h"
#include "components/state_estimator/state_estimator.pb.h"

namespace poise {
namespace {

using Eigen::Vector3d;

void RequirePositive(double value, const char* field, const char* unit) {
  if (!(value > 0) || !std::isfinite(value)) {
    throw ConfigError(field, std::string("must be a finite number of ") + unit + " above 0");
  }
}

BaseEstimatorConfig ReadConfig(const StateEstimatorConfig& config) {
  RequirePositive(config.joint_velocity_cutoff(), "joint_velocity_cutoff", "Hz");
  RequirePositive(config.orientation_time_constant(), "orientation_time_constant", "s");
  RequirePositive(config.gravity_time_constant(), "gravity_time_constant", "s");
  RequirePositive(config.gyro_bias_time_constant(), "gyro_bias_time_constant", "s");
  RequirePositive(config.anchor_time_constant(), "anchor_time_constant", "s");
  RequirePositive(config.foot_rotation_tolerance(), "foot_rotation_tolerance", "rad");
  if (config.gyro_bias_time_constant() < 4 * config.orientation_time_constant()) {
    throw ConfigError("gyro_bias_time_constant",
                      "must be at least four times orientation_time_constant, or the estimate "
                      "oscillates");
  }
  if (!(config.light_load() >= 0)) throw ConfigError("light_load", "must not be negative");
  if (!(config.full_load() > config.light_load() && config.full_load() <= 0.5)) {
    throw ConfigError("full_load",
                      "must be above light_load and at most 0.5, a foot's share in even standing");
  }
  BaseEstimatorConfig result;
  result.joint_velocity_cutoff = config.joint_velocity_cutoff();
  result.orientation_time_constant = config.orientation_time_constant();
  result.gravity_time_constant = config.gravity_time_constant();
  result.gyro_bias_time_constant = config.gyro_bias_time_constant();
  result.anchor_time_constant = config.anchor_time_constant();
  result.foot_rotation_tolerance = config.foot_rotation_tolerance();
  result.light_load = config.light_load();
  result.full_load = config.full_load();
  return result;
}

void Write(const Vector3d& v, double* out) { std::copy_n(v.data(), 3, out); }

}  // namespace

void StateEstimator::Configure(const ComponentContext& context, Wiring* wiring) {
  const BaseEstimatorConfig config = ReadConfig(context.config<StateEstimatorConfig>());
  const std::shared_ptr<const robot::RobotModel> model = LoadRobot(context);
  const MessageCounts counts = JointAndFootCounts(*model);
  wiring->AddInput(&robot_sensors_, "robot_sensors", counts);
  wiring->AddOutput(&robot_state_, "robot_state", counts);
  wiring->AddStage("estimate", {&robot_sensors_}, {&robot_state_},
                   [this](const Tick& tick) { Estimate(tick); });
  estimator_ = std::make_unique<BaseEstimator>(model, config, context.tick_period);
}

bool StateEstimator::Archive(StateArchive* archive) {
  archive->Show(last_time_);
  estimator_->Archive(archive);
  return true;
}

void StateEstimator::Estimate(const Tick& tick) {
  const robot_sensors_t& in = *robot_sensors_;
  const BaseSensors sensors = {
      {in.joint_position.data(), in.num_joints},
      Vector3d(in.imu_angular_velocity),
      Vector3d(in.imu_acceleration),
      {-in.foot_wrench[0].force[2], -in.foot_wrench[1].force[2]},
  };
  estimator_->Update(sensors, tick.time - last_time_);
  last_time_ = tick.time;

  const robot::RobotState& state = estimator_->state();
  robot_state_t& out = *robot_state_;
  Write(state.base_position, out.base_position);
  out.base_orientation[0] = state.base_orientation.w();
  Write(state.base_orientation.vec(), out.base_orientation + 1);
  Write(state.base_linear_velocity, out.base_linear_velocity);
  Write(state.base_angular_velocity, out.base_angular_velocity);
  std::copy_n(state.joint_position.data(), state.joint_position.size(), out.joint_position.data());
  std::copy_n(state.joint_velocity.data(), state.joint_velocity.size(), out.joint_velocity.data());
  std::copy(in.foot_wrench.begin(), in.foot_wrench.end(), out.foot_wrench.begin());
  std::copy(estimator_->foot_weight().begin(), estimator_->foot_weight().end(),
            out.foot_load_share.begin());
  Write(estimator_->gyro_bias(), out.imu_bias_angular_velocity);
}

}  // namespace poise
