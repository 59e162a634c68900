// The robot that is simulated: the controller's model with the scenario's errors and changes.
#pragma once

#include <vector>

#include "components/robot/robot_model.h"
#include "sim/sim.pb.h"

namespace poise {

/// Standard deviations, per sample but for the biases, which are constant.
struct SensorNoise {
  double gyro = 0, gyro_bias = 0;                    ///< rad/s
  double accelerometer = 0, accelerometer_bias = 0;  ///< m/s²
  double force = 0;                                  ///< N
  double moment = 0;                                 ///< N·m
  double push = 0;                                   ///< N, of the push sensor
};

/// `model` with the configuration's model_error. Throws ConfigError: no such link, a mass that is
/// none.
robot::RobotModel WithModelErrors(const robot::RobotModel& model, const SimConfig& config);

/// The model's motors, by joint, with the configuration's motor_change. Throws ConfigError: no such
/// joint, a value out of range, a field that a scenario cannot change.
std::vector<robot::MotorModel> SimulatedMotors(const robot::RobotModel& model,
                                               const SimConfig& config);

/// The model's drive train with the configuration's drive_train; without robot_drive_train the
/// latter alone.
DriveTrain SimulatedDriveTrain(const robot::RobotModel& model, const SimConfig& config);

/// The robot file's noise with the configuration's imu_change, force_noise and moment_noise; none
/// without sensor_noise. Throws ConfigError.
SensorNoise SimulatedNoise(const robot::RobotModel& model, const SimConfig& config);

}  // namespace poise
