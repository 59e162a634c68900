#include "sim_ode/sensors.h"

#include <cmath>
#include <numbers>

namespace poise {

using Eigen::Vector3d;

namespace {

constexpr uint64_t kSensorStream = 2;

}  // namespace

SensorReadings::SensorReadings(int num_joints)
    : position_counts(static_cast<size_t>(num_joints), 0),
      imu_angular_velocity(Vector3d::Zero()),
      imu_acceleration(Vector3d::Zero()),
      push_force(Vector3d::Zero()) {
  foot_wrench.fill(robot::Vector6d::Zero());
}

Sensors::Sensors(const robot::RobotModel& model, bool noise, double push_noise, uint64_t seed)
    : gyro_noise_(noise ? model.imu().gyro_noise : 0),
      accelerometer_noise_(noise ? model.imu().accelerometer_noise : 0),
      force_noise_(noise ? model.force_noise() : 0),
      moment_noise_(noise ? model.moment_noise() : 0),
      push_noise_(noise ? push_noise : 0),
      random_(seed, kSensorStream) {
  for (const robot::MotorModel& motor : model.motors()) {
    counts_per_radian_.push_back(motor.gear_ratio * motor.encoder_counts / (2 * std::numbers::pi));
  }
  gyro_bias_ = Noise(noise ? model.imu().gyro_bias : 0);
  accelerometer_bias_ = Noise(noise ? model.imu().accelerometer_bias : 0);
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
  readings->imu_angular_velocity = truth.imu_angular_velocity + gyro_bias_ + Noise(gyro_noise_);
  readings->imu_acceleration =
      truth.imu_specific_force + accelerometer_bias_ + Noise(accelerometer_noise_);
  for (size_t f = 0; f < 2; ++f) {
    readings->foot_wrench[f] = truth.foot_wrench[f];
    readings->foot_wrench[f].head<3>() += Noise(force_noise_);
    readings->foot_wrench[f].tail<3>() += Noise(moment_noise_);
  }
  readings->push_force = truth.push_force + Noise(push_noise_);
}

}  // namespace poise
