#include "sim/simulated_robot.h"

#include <fmt/format.h>

#include <string>

#include "components/framework/configuration/configuration.h"
#include "sim/push.h"

namespace poise {
namespace {

using robot::MotorModel;
using robot::RobotModel;

[[noreturn]] void RefuseChange(const std::string& field) {
  throw ConfigError(field,
                    "is what the controller's side knows of the drive: change it in the "
                    "robot file");
}

void CheckChange(const Motor& change, const std::string& field) {
  if (change.has_gear_ratio()) RefuseChange(field + ".gear_ratio");
  if (change.has_rated_current()) RefuseChange(field + ".rated_current");
  if (change.has_peak_current()) RefuseChange(field + ".peak_current");
  if (change.has_encoder_counts()) RefuseChange(field + ".encoder_counts");
}

void Apply(const Motor& change, const std::string& field, MotorModel* motor) {
  if (change.has_torque_constant()) motor->torque_constant = change.torque_constant();
  if (change.has_rotor_inertia()) {
    motor->reflected_inertia = change.rotor_inertia() * motor->gear_ratio * motor->gear_ratio;
  }
  // A file without Stribeck peak has none with another Coulomb friction either.
  const bool peak = motor->static_friction > motor->coulomb_friction;
  if (change.has_coulomb_friction()) motor->coulomb_friction = change.coulomb_friction();
  if (change.has_viscous_friction()) motor->viscous_friction = change.viscous_friction();
  if (change.has_static_friction()) {
    motor->static_friction = change.static_friction();
  } else if (!peak) {
    motor->static_friction = motor->coulomb_friction;
  }
  if (change.has_stribeck_velocity()) motor->stribeck_velocity = change.stribeck_velocity();
  if (motor->static_friction < motor->coulomb_friction) {
    throw ConfigError(field + ".static_friction",
                      fmt::format("{} N·m is below the Coulomb friction of {} N·m",
                                  motor->static_friction, motor->coulomb_friction));
  }
}

}  // namespace

RobotModel WithModelErrors(const RobotModel& model, const SimConfig& config) {
  RobotModel result = model;
  if (config.imu_roll() != 0 || config.imu_pitch() != 0) {
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(config.imu_pitch(), Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(config.imu_roll(), Eigen::Vector3d::UnitX()))
                                     .toRotationMatrix();
    result = result.WithImuTurned(turn);
  }
  for (int i = 0; i < config.model_error_size(); ++i) {
    const ModelError& error = config.model_error(i);
    const std::string field = "model_error[" + std::to_string(i) + "]";
    const std::string link = error.has_link()
                                 ? error.link()
                                 : model.bodies()[static_cast<size_t>(model.body_task_body())].name;
    FindBody(model, link, field + ".link");
    try {
      result = result.WithModelError(link, error.mass_scale(),
                                     {error.com_x(), error.com_y(), error.com_z()});
    } catch (const robot::RobotError& refused) {
      throw ConfigError(field, refused.what());
    }
  }
  return result;
}

std::vector<MotorModel> SimulatedMotors(const RobotModel& model, const SimConfig& config) {
  std::vector<MotorModel> motors = model.motors();
  for (int i = 0; i < config.motor_change_size(); ++i) {
    const Motor& change = config.motor_change(i);
    const std::string field = fmt::format("motor_change[{}]", i);
    CheckChange(change, field);
    if (change.joint_size() == 0) {
      for (MotorModel& motor : motors) Apply(change, field, &motor);
    }
    for (int j = 0; j < change.joint_size(); ++j) {
      const int joint = model.FindJoint(change.joint(j));
      if (joint < 0) {
        throw ConfigError(
            fmt::format("{}.joint[{}]", field, j),
            fmt::format("robot '{}' has no joint '{}'", model.name(), change.joint(j)));
      }
      Apply(change, field, &motors[static_cast<size_t>(joint)]);
    }
  }
  for (MotorModel& motor : motors) motor.reflected_inertia *= config.rotor_inertia_scale();
  return motors;
}

DriveTrain SimulatedDriveTrain(const RobotModel& model, const SimConfig& config) {
  DriveTrain result;
  if (config.robot_drive_train()) {
    const robot::DriveTrainModel& drive = model.drive_train();
    result.set_torque_lag(drive.torque_lag);
    result.set_current_resolution(drive.current_resolution);
    result.set_backlash(drive.backlash);
    result.set_gear_stiffness(config.gear_stiffness_scale() * drive.gear_stiffness);
    result.set_gear_damping(drive.gear_damping);
    result.set_link_encoder(drive.link_encoder);
    result.set_sensor_delay(drive.sensor_delay);
  }
  result.MergeFrom(config.drive_train());
  return result;
}

SensorNoise SimulatedNoise(const RobotModel& model, const SimConfig& config) {
  const Imu& change = config.imu_change();
  if (change.has_link()) RefuseChange("imu_change.link");
  if (change.has_pose()) RefuseChange("imu_change.pose");
  const auto choose = [](bool given, double value, double other) { return given ? value : other; };
  const robot::ImuModel& imu = model.imu();
  const SensorNoise noise{
      .gyro = choose(change.has_gyro_noise(), change.gyro_noise(), imu.gyro_noise),
      .gyro_bias = choose(change.has_gyro_bias(), change.gyro_bias(), imu.gyro_bias),
      .accelerometer = choose(change.has_accelerometer_noise(), change.accelerometer_noise(),
                              imu.accelerometer_noise),
      .accelerometer_bias = choose(change.has_accelerometer_bias(), change.accelerometer_bias(),
                                   imu.accelerometer_bias),
      .force = choose(config.has_force_noise(), config.force_noise(), model.force_noise()),
      .moment = choose(config.has_moment_noise(), config.moment_noise(), model.moment_noise()),
      .push = config.push_sensor_noise()};
  return config.sensor_noise() ? noise : SensorNoise{};
}

}  // namespace poise
