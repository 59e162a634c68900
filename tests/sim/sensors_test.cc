#include "sim/sensors.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "poise/drive_feedback_t.hpp"
#include "sim/foot_sensors.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using Eigen::Vector3d;

TEST(RandomStream, GaussianMomentsAndTails) {
  RandomStream random(3, 0);
  constexpr int kDraws = 400000;
  double sum = 0, squares = 0, fourth = 0;
  int outside = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.Gaussian();
    sum += x;
    squares += x * x;
    fourth += x * x * x * x;
    outside += std::abs(x) > 1.959964 ? 1 : 0;
  }
  // Five standard errors each.
  EXPECT_NEAR(sum / kDraws, 0, 5 / std::sqrt(kDraws));
  EXPECT_NEAR(squares / kDraws, 1, 5 * std::sqrt(2.0 / kDraws));
  EXPECT_NEAR(fourth / kDraws, 3, 5 * std::sqrt(96.0 / kDraws));
  EXPECT_NEAR(static_cast<double>(outside) / kDraws, 0.05, 5 * std::sqrt(0.05 * 0.95 / kDraws));
}

TEST(RandomStream, SeedsAndStreamsDiffer) {
  RandomStream a(1, 1), same(1, 1), seed(2, 1), stream(1, 2);
  const double first = a.Uniform();
  EXPECT_EQ(first, same.Uniform());
  EXPECT_NE(first, seed.Uniform());
  EXPECT_NE(first, stream.Uniform());
}

SensorNoise Noise(const robot::RobotModel& model, bool on, double push) {
  SimConfig config;
  config.set_sensor_noise(on);
  config.set_push_sensor_noise(push);
  return SimulatedNoise(model, config);
}

class SensorsTest : public ::testing::Test {
 protected:
  SensorsTest()
      : model_(PaperRobot()), truth_(model_.num_joints()), readings_(model_.num_joints()) {
    truth_.imu_specific_force = Vector3d(0.1, 0.2, 9.8);
    truth_.foot_wrench[0] << 1, 2, 270, 4, 5, 6;
  }
  robot::RobotModel model_;
  SimulationTruth truth_;
  SensorReadings readings_;
};

TEST_F(SensorsTest, EncodersCountTurnsOfTheMotor) {
  Sensors sensors(model_, Noise(model_, true, 0), 1);
  const double count = 2 * std::numbers::pi / (50.0 * 8192);  // gear and encoder of the robot file
  truth_.encoder_position[0] = 1000.4 * count;
  truth_.encoder_position[1] = -1000.6 * count;
  truth_.encoder_position[2] = 3 * 2 * std::numbers::pi;  // three joint turns
  sensors.Measure(truth_, &readings_);
  EXPECT_EQ(readings_.position_counts[0], 1000);
  EXPECT_EQ(readings_.position_counts[1], -1001);
  EXPECT_EQ(readings_.position_counts[2], 3 * 50 * 8192);
}

TEST_F(SensorsTest, WithoutNoiseTheTruth) {
  Sensors sensors(model_, Noise(model_, false, 0.2), 1);
  truth_.encoder_velocity.setLinSpaced(-1, 2);
  truth_.imu_orientation = Eigen::AngleAxisd(0.7, Vector3d(1, -2, 3).normalized());
  sensors.Measure(truth_, &readings_);
  EXPECT_EQ(readings_.imu_acceleration, truth_.imu_specific_force);
  EXPECT_EQ(readings_.imu_angular_velocity, truth_.imu_angular_velocity);
  EXPECT_EQ(readings_.velocity, truth_.encoder_velocity);
  EXPECT_LT(readings_.imu_orientation.angularDistance(truth_.imu_orientation), 1e-12);
  EXPECT_EQ(readings_.foot_wrench[0], truth_.foot_wrench[0]);
  EXPECT_EQ(readings_.push_force, truth_.push_force);
}

TEST_F(SensorsTest, NoiseHasTheDeviationsOfTheRobotFile) {
  Sensors sensors(model_, Noise(model_, true, 0.2), 11);
  constexpr int kSamples = 50000;
  struct Statistics {
    double sum = 0, squares = 0;
    void Add(double x) {
      sum += x;
      squares += x * x;
    }
    double mean() const { return sum / kSamples; }
    double deviation() const { return std::sqrt(squares / kSamples - mean() * mean()); }
  };
  Statistics gyro, accelerometer, force, moment, push;
  for (int i = 0; i < kSamples; ++i) {
    sensors.Measure(truth_, &readings_);
    gyro.Add(readings_.imu_angular_velocity.y());
    accelerometer.Add(readings_.imu_acceleration.z() - 9.8);
    force.Add(readings_.foot_wrench[0][2] - 270);
    moment.Add(readings_.foot_wrench[1][4]);
    push.Add(readings_.push_force.x());
  }
  const double tolerance = 5 / std::sqrt(2.0 * kSamples);  // five standard errors, relative
  EXPECT_NEAR(gyro.deviation() / 2e-4, 1, tolerance);
  EXPECT_NEAR(accelerometer.deviation() / 1.7e-2, 1, tolerance);
  EXPECT_NEAR(force.deviation() / 1.0, 1, tolerance);
  EXPECT_NEAR(moment.deviation() / 0.05, 1, tolerance);
  EXPECT_NEAR(push.deviation() / 0.2, 1, tolerance);
  EXPECT_NEAR(gyro.mean(), sensors.gyro_bias().y(), 5 * 2e-4 / std::sqrt(kSamples));
  EXPECT_NEAR(accelerometer.mean(), sensors.accelerometer_bias().z(),
              5 * 1.7e-2 / std::sqrt(kSamples));
  EXPECT_NEAR(force.mean(), 0, 5 / std::sqrt(kSamples));
}

// What the accelerometer reads at rest is up to the IMU's filter: both say the same.
TEST_F(SensorsTest, TheOrientationIsLevelAsTheAccelerometerSeesIt) {
  truth_.imu_orientation = Eigen::AngleAxisd(0.7, Vector3d(1, -2, 3).normalized());
  truth_.imu_specific_force = truth_.imu_orientation.conjugate() * Vector3d(0, 0, robot::kGravity);
  const robot::RobotModel quiet = EditedRobot(
      [](Robot* description) { description->mutable_imu()->set_accelerometer_noise(0); });
  Sensors sensors(quiet, Noise(quiet, true, 0), 3);
  sensors.Measure(truth_, &readings_);
  const Vector3d up = readings_.imu_orientation * readings_.imu_acceleration.normalized();
  EXPECT_LT((up - Vector3d::UnitZ()).norm(), 1e-12);
  // The file's bias of 0.1 m/s² is some 10 mrad of tilt.
  const double off = readings_.imu_orientation.angularDistance(truth_.imu_orientation);
  EXPECT_GT(off, 1e-4);
  EXPECT_LT(off, 0.05);
}

TEST_F(SensorsTest, BiasIsDrawnOncePerSeed) {
  double squares = 0;
  constexpr int kSeeds = 3000;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    squares += Sensors(model_, Noise(model_, true, 0), seed).accelerometer_bias().squaredNorm() / 3;
  }
  EXPECT_NEAR(std::sqrt(squares / kSeeds) / 0.1, 1, 5 / std::sqrt(6.0 * kSeeds));
}

TEST_F(SensorsTest, SameSeedSameSamples) {
  Sensors a(model_, Noise(model_, true, 0.2), 4), same(model_, Noise(model_, true, 0.2), 4),
      other(model_, Noise(model_, true, 0.2), 5);
  SensorReadings from_same(model_.num_joints()), from_other(model_.num_joints());
  for (int i = 0; i < 100; ++i) {
    a.Measure(truth_, &readings_);
    same.Measure(truth_, &from_same);
    other.Measure(truth_, &from_other);
    EXPECT_EQ(readings_.foot_wrench[1], from_same.foot_wrench[1]);
    EXPECT_EQ(readings_.imu_acceleration, from_same.imu_acceleration);
    EXPECT_NE(readings_.foot_wrench[1], from_other.foot_wrench[1]);
    EXPECT_NE(readings_.imu_acceleration, from_other.imu_acceleration);
  }
}

TEST_F(SensorsTest, OneSensorsNoiseDoesNotMoveAnothers) {
  const robot::RobotModel quiet_feet = EditedRobot([](Robot* description) {
    description->set_force_noise(0);
    description->mutable_imu()->set_gyro_noise(0);
  });
  Sensors a(model_, Noise(model_, true, 0.2), 4), b(quiet_feet, Noise(quiet_feet, true, 0), 4);
  SensorReadings from_b(model_.num_joints());
  for (int i = 0; i < 10; ++i) {
    a.Measure(truth_, &readings_);
    b.Measure(truth_, &from_b);
    EXPECT_EQ(readings_.imu_acceleration, from_b.imu_acceleration);
    EXPECT_EQ(readings_.foot_wrench[0].tail<3>(), from_b.foot_wrench[0].tail<3>());
  }
}

TEST_F(SensorsTest, FeetFailAsConfigured) {
  SimConfig config;
  const auto add = [&](const char* foot, FootSensorFault::Kind kind, double start, double end) {
    FootSensorFault* fault = config.add_foot_sensor_fault();
    fault->set_foot(foot);
    fault->set_kind(kind);
    fault->set_start(start);
    fault->set_end(end);
    fault->set_force_z(50);
  };
  add("right", FootSensorFault::FROZEN, 1, 2);
  add("right", FootSensorFault::BIASED, 2, 3);
  add("right", FootSensorFault::INVALID, 3, 4);
  add("left", FootSensorFault::DEAD, 1, 2);
  FootSensors feet(model_, config);
  const auto read = [&](double time) {
    for (size_t f = 0; f < 2; ++f) {
      readings_.foot_wrench[f].setConstant(time);
    }
    feet.Apply(time, &readings_);
  };
  const robot::Vector6d ones = robot::Vector6d::Ones();
  read(0.5);
  EXPECT_EQ(readings_.foot_wrench[0], 0.5 * ones);
  read(1);
  EXPECT_EQ(readings_.foot_wrench[0], 0.5 * ones);
  EXPECT_EQ(readings_.foot_wrench[1], 0 * ones);
  EXPECT_EQ(readings_.foot_sensor[1], drive_feedback_t::SENSOR_OK) << "it does not know";
  read(1.5);
  EXPECT_EQ(readings_.foot_wrench[0], 0.5 * ones);
  read(2);
  EXPECT_EQ(readings_.foot_wrench[0], 2 * ones + 50 * robot::Vector6d::Unit(2));
  EXPECT_EQ(readings_.foot_wrench[1], 2 * ones);
  read(3);
  EXPECT_EQ(readings_.foot_sensor[0], drive_feedback_t::SENSOR_INVALID);
  EXPECT_EQ(readings_.foot_wrench[0], 0 * ones);
  read(4);
  EXPECT_EQ(readings_.foot_sensor[0], drive_feedback_t::SENSOR_OK);

  config.set_foot_sensors(false);
  FootSensors none(model_, config);
  none.Apply(0, &readings_);
  EXPECT_EQ(readings_.foot_sensor[1], drive_feedback_t::SENSOR_ABSENT);
  config.mutable_foot_sensor_fault(0)->set_foot("middle");
  EXPECT_THROW(FootSensors(model_, config), ConfigError);
}

}  // namespace
}  // namespace poise
