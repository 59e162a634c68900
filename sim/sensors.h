// From the truth to what encoders, IMU, foot sensors and the push sensor report.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "components/robot/robot_model.h"
#include "sim/random.h"
#include "sim/simulated_robot.h"
#include "sim/simulation.h"

namespace poise {

struct SensorReadings {
  explicit SensorReadings(int num_joints);

  std::vector<int64_t> position_counts;           ///< at the motor shaft, multi-turn
  Eigen::VectorXd velocity;                       ///< rad/s, of the joint
  Eigen::Vector3d imu_angular_velocity;           ///< rad/s, IMU frame
  Eigen::Vector3d imu_acceleration;               ///< m/s², IMU frame, specific force
  Eigen::Quaterniond imu_orientation;             ///< IMU to world, of the IMU's own filter
  robot::FootArray<robot::Vector6d> foot_wrench;  ///< environment on robot, sole frame
  robot::FootArray<int8_t> foot_sensor{};         ///< drive_feedback_t::SENSOR_*
  Eigen::Vector3d push_force;                     ///< N, world
};

/// Gaussian noise of each sample and IMU biases drawn once. Every
/// number is drawn in the same order whatever is switched off, so switching the noise of one sensor
/// off leaves the others' as they were.
class Sensors {
 public:
  /// Without noise only the encoders' quantisation remains.
  Sensors(const robot::RobotModel& model, const SensorNoise& noise, uint64_t seed);

  /// One sample of every sensor. Does not allocate.
  void Measure(const SimulationTruth& truth, SensorReadings* readings);

  const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }                    ///< rad/s
  const Eigen::Vector3d& accelerometer_bias() const { return accelerometer_bias_; }  ///< m/s²

 private:
  Eigen::Vector3d Noise(double deviation);

  std::vector<double> counts_per_radian_;
  SensorNoise noise_;
  RandomStream random_;
  Eigen::Vector3d gyro_bias_, accelerometer_bias_;
};

}  // namespace poise
