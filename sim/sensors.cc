#include "sim/sensors.h"

#include <cmath>
#include <numbers>

namespace poise {

using Eigen::Vector3d;
using robot::kFeet;

namespace {

constexpr uint64_t kSensorStream = 2;

}  // namespace

SensorReadings::SensorReadings(int num_joints)
    : position_counts(static_cast<size_t>(num_joints), 0),
      velocity(Eigen::VectorXd::Zero(num_joints)),
      imu_angular_velocity(Vector3d::Zero()),
      imu_acceleration(Vector3d::Zero()),
      imu_orientation(Eigen::Quaterniond::Identity()),
      push_force(Vector3d::Zero()) {
  foot_wrench.fill(robot::Vector6d::Zero());
}

Sensors::Sensors(const robot::RobotModel& model, const SensorNoise& noise, uint64_t seed)
    : noise_(noise), random_(seed, kSensorStream) {
  for (const robot::MotorModel& motor : model.motors()) {
    counts_per_radian_.push_back(motor.gear_ratio * motor.encoder_counts / (2 * std::numbers::pi));
  }
  gyro_bias_ = Noise(noise_.gyro_bias);
  accelerometer_bias_ = Noise(noise_.accelerometer_bias);
}

Vector3d Sensors::Noise(double deviation) {
  Vector3d noise;
  for (int i = 0; i < 3; ++i) noise[i] = deviation * random_.Gaussian();
  return noise;
}

void Sensors::Measure(const SimulationTruth& truth, SensorReadings* readings) {
  for (size_t j = 0; j < counts_per_radian_.size(); ++j) {
    const double position = truth.encoder_position[static_cast<Eigen::Index>(j)];
    readings->position_counts[j] = std::llround(position * counts_per_radian_[j]);
  }
  readings->velocity = truth.encoder_velocity;
  readings->imu_angular_velocity = truth.imu_angular_velocity + gyro_bias_ + Noise(noise_.gyro);
  readings->imu_acceleration =
      truth.imu_specific_force + accelerometer_bias_ + Noise(noise_.accelerometer);
  // The filter levels by the accelerometer, whose bias looks like a tilt.
  const Vector3d up = truth.imu_orientation.conjugate() * Vector3d::UnitZ();
  const Vector3d seen_up = up + accelerometer_bias_ / robot::kGravity;
  readings->imu_orientation =
      truth.imu_orientation * Eigen::Quaterniond::FromTwoVectors(seen_up, up);
  for (const robot::Foot f : kFeet) {
    readings->foot_wrench[f] = truth.foot_wrench[f];
    readings->foot_wrench[f].head<3>() += Noise(noise_.force);
    readings->foot_wrench[f].tail<3>() += Noise(noise_.moment);
  }
  readings->push_force = truth.push_force + Noise(noise_.push);
}

}  // namespace poise
