// The component: messages in, messages out, configuration refused by field. The estimate itself:
// invariant_estimator_test.
#include "components/state_estimator/state_estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/components/base_motion.h"
#include "tests/components/control_fixture.h"

namespace poise {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using robot::TestRobot;

constexpr const char* kIdealDrives = "invariant_ekf { gear_stiffness: 0 sensor_delay: 0 }";
constexpr const char* kGears = "invariant_ekf { gear_stiffness: 7e4 sensor_delay: 0.002 }";

robot_sensors_t Message(const BaseSensors& sensors) {
  robot_sensors_t message;
  const int n = static_cast<int>(sensors.joint_position.size());
  MessageTraits<robot_sensors_t>::Resize(message, MessageCounts{n, 2});
  for (int j = 0; j < n; ++j) {
    message.joint_position[static_cast<size_t>(j)] = sensors.joint_position[j];
  }
  for (int i = 0; i < 3; ++i) {
    message.imu_angular_velocity[i] = sensors.angular_velocity[i];
    message.imu_acceleration[i] = sensors.acceleration[i];
  }
  // Robot on environment: the loaded sole pushes down.
  for (size_t f = 0; f < 2; ++f) {
    message.foot_wrench[f].force[2] = -sensors.foot_load[f];
    message.foot_wrench[f].moment[0] = 1.5 + static_cast<double>(f);
  }
  return message;
}

TEST(StateEstimator, PublishesTheStateTheWrenchesAndTheWeights) {
  BaseMotion motion(robot::RobotPath(TestRobot::kDyros));
  const Quaterniond turned(AngleAxisd(0.1, Vector3d(0.6, 0.8, 0)));
  motion.script().base_orientation = [=](double) { return turned; };
  const Vector3d start = motion.start().base_position;
  motion.script().base_position = [=](double t) -> Vector3d {
    return start + Vector3d(0, 0.05 * t, -0.03);
  };
  motion.script().load = {[](double) { return 0.75; }, [](double) { return 0.25; }};
  ControlContext context(TestRobot::kDyros);
  // Joints are published predicted over the sensors' delay, less the gears' windup.
  Harness<StateEstimator> harness(&context, kIdealDrives);
  for (int64_t tick = 0; tick < 200; ++tick) {
    motion.Next();
    const robot_sensors_t sensors = Message(motion.sensors());
    harness.Bind("robot_sensors", &sensors);
    harness.Run(TickAt(tick));
    const robot_state_t& state = harness.output<robot_state_t>();
    ASSERT_EQ(state.tick, tick);
    ASSERT_EQ(state.joint_position, sensors.joint_position);
    ASSERT_EQ(state.foot_wrench[1].moment[0], 2.5);
    ASSERT_EQ(state.foot_wrench[0].force[2], sensors.foot_wrench[0].force[2]);
    ASSERT_NEAR(state.foot_load_share[0], 0.75, 1e-9);
    ASSERT_NEAR(state.foot_load_share[1], 0.25, 1e-9);
  }
  const robot_state_t& state = harness.output<robot_state_t>();
  const robot::RobotState& truth = motion.truth();
  const Quaterniond orientation(state.base_orientation[0], state.base_orientation[1],
                                state.base_orientation[2], state.base_orientation[3]);
  EXPECT_LT(orientation.angularDistance(turned), 1e-5);
  EXPECT_LT((Vector3d(state.base_position) - truth.base_position).norm(), 1e-5);
  // Constant joint rates bring no lag; the rates change slowly with the posture.
  EXPECT_LT((Vector3d(state.base_linear_velocity) - truth.base_linear_velocity).norm(), 1e-3);
  EXPECT_LT(Vector3d(state.base_angular_velocity).norm(), 1e-4);
  for (int j = 0; j < truth.joint_velocity.size(); ++j) {
    EXPECT_NEAR(state.joint_velocity[static_cast<size_t>(j)], truth.joint_velocity[j], 2e-3);
  }
}

TEST(StateEstimator, ReportsTheGyroBias) {
  BaseMotion motion(robot::RobotPath(TestRobot::kMantis));
  const Vector3d bias(1e-4, -2e-4, 1.5e-4);
  motion.errors().gyro_bias = bias;
  ControlContext context(TestRobot::kMantis);
  Harness<StateEstimator> harness(&context, "");
  for (int64_t tick = 0; tick < 50000; ++tick) {
    motion.Next();
    const robot_sensors_t sensors = Message(motion.sensors());
    harness.Bind("robot_sensors", &sensors);
    harness.Run(TickAt(tick));
  }
  const Vector3d found(harness.output<robot_state_t>().imu_bias_angular_velocity);
  EXPECT_LT((found - bias).norm(), 0.01 * bias.norm());
}

template <class Message>
std::vector<uint8_t> Encoded(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  EXPECT_EQ(message.encode(bytes.data(), 0, message.getEncodedSize()), message.getEncodedSize());
  return bytes;
}

// Shifts the weight to the right foot, lifts the left one and puts it down again, swaying.
void Step(BaseMotion* motion) {
  const Vector3d p = motion->start().base_position;
  motion->script().base_position = [=](double t) -> Vector3d {
    return p + Vector3d(0.02 * std::sin(3 * t), -0.03 * std::sin(2 * t), -0.03);
  };
  const Eigen::Isometry3d start = motion->script().foot[1](0);
  motion->script().foot[1] = [=](double t) -> Eigen::Isometry3d {
    const double s = std::clamp((t - 0.4) / 0.4, 0.0, 1.0);
    return Eigen::Translation3d(0, 0, 0.02 * std::pow(std::sin(std::numbers::pi * s), 2)) * start;
  };
  motion->script().load[1] = [](double t) { return t > 0.4 && t < 0.8 ? 0.0 : 0.5; };
  motion->script().load[0] = [load = motion->script().load[1]](double t) { return 1 - load(t); };
}

// The state is saved at rest, in the air and on both feet.
TEST(StateEstimator, AFreshEstimatorGoesOnWithASavedStateAndTheSameBits) {
  for (const TestRobot robot : {TestRobot::kDyros, TestRobot::kMantis}) {
    for (const int64_t taken_over : {1, 40, 300, 450}) {
      BaseMotion motion(robot::RobotPath(robot));
      Step(&motion);
      motion.errors() = TypicalErrors(*motion.model());
      ControlContext context(robot);
      Harness<StateEstimator> first(&context, kGears);
      Harness<StateEstimator> second(&context, kGears);
      for (int64_t tick = 0; tick < taken_over + 200; ++tick) {
        motion.Next();
        const robot_sensors_t sensors = Message(motion.sensors());
        if (tick == taken_over) second.Restore(first.Save());
        first.Bind("robot_sensors", &sensors);
        first.Run(TickAt(tick));
        if (tick < taken_over) continue;
        second.Bind("robot_sensors", &sensors);
        second.Run(TickAt(tick));
        ASSERT_EQ(Encoded(second.output<robot_state_t>()), Encoded(first.output<robot_state_t>()))
            << tick;
        ASSERT_EQ(Encoded(second.output<estimator_status_t>()),
                  Encoded(first.output<estimator_status_t>()))
            << tick;
      }
    }
  }
}

// In real time inputs may come too late: the next one is then several periods away.
TEST(StateEstimator, SkippedTicksAreBridged) {
  BaseMotion motion(robot::RobotPath(TestRobot::kDyros));
  const Vector3d start = motion.start().base_position;
  // Constant acceleration, then constant speed: what is skipped lies in both.
  constexpr double kAcceleration = 0.2, kUntil = 0.5;
  motion.script().base_position = [=](double t) -> Vector3d {
    const double s = std::max(t - 0.3, 0.0), a = std::min(s, kUntil);
    const double way = 0.5 * kAcceleration * a * a + kAcceleration * a * (s - a);
    return start + Vector3d(0, way, -0.05);
  };
  ControlContext context(TestRobot::kDyros);
  Harness<StateEstimator> harness(&context, kGears);
  constexpr int64_t kGap = 25;  // ticks, 50 ms
  for (int64_t tick = 0; tick < 600; ++tick) {
    motion.Next();
    // Every seventh tick beside the gaps, too.
    if (tick % 7 == 3 || (tick > 200 && tick < 200 + kGap) || (tick > 480 && tick < 480 + kGap)) {
      continue;
    }
    const robot_sensors_t sensors = Message(motion.sensors());
    harness.Bind("robot_sensors", &sensors);
    harness.Run(TickAt(tick));
    const robot_state_t& state = harness.output<robot_state_t>();
    const robot::RobotState& truth = motion.truth();
    // The filter of the joint velocities lags by √2 / (2 π 20 Hz), and by half a gap after one.
    const double lag = 0.0113 + 0.5 * 0.002 * kGap;
    ASSERT_LT((Vector3d(state.base_linear_velocity) - truth.base_linear_velocity).norm(),
              kAcceleration * lag + 2e-3)
        << tick;
    ASSERT_LT((Vector3d(state.base_position) - truth.base_position).norm(), 1e-3) << tick;
  }
  const double speed = motion.truth().base_linear_velocity.y();
  EXPECT_NEAR(speed, kAcceleration * kUntil, 1e-6);
  EXPECT_NEAR(harness.output<robot_state_t>().base_linear_velocity[1], speed, 2e-3);
}

struct ConfigCase {
  const char* text;
  const char* field;
};
class StateEstimatorConfiguration : public testing::TestWithParam<ConfigCase> {};

TEST_P(StateEstimatorConfiguration, IsRefusedByField) {
  ControlContext context(TestRobot::kDyros);
  try {
    Harness<StateEstimator> harness(&context, GetParam().text);
    FAIL() << GetParam().text;
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), GetParam().field);
    EXPECT_THAT(error.what(), testing::HasSubstr("must"));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Fields, StateEstimatorConfiguration,
    testing::Values(ConfigCase{"joint_velocity_cutoff: 0", "joint_velocity_cutoff"},
                    ConfigCase{"joint_velocity_cutoff: nan", "joint_velocity_cutoff"},
                    ConfigCase{"invariant_ekf { sensor_delay: 0.1 }", "invariant_ekf.sensor_delay"},
                    ConfigCase{"invariant_ekf { start_yaw: 0 }", "invariant_ekf.start_yaw"},
                    ConfigCase{"invariant_ekf { cop_margin: nan }", "invariant_ekf.cop_margin"}));

}  // namespace
}  // namespace poise
