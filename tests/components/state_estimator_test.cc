// The component: messages in, messages out, configuration refused by field. The estimate itself:
// base_estimator_test.
#include "components/state_estimator/state_estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/components/base_motion.h"
#include "tests/components/control_fixture.h"

namespace poise {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using robot::TestRobot;

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
  Harness<StateEstimator> harness(&context, "");
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
                    ConfigCase{"orientation_time_constant: -1", "orientation_time_constant"},
                    ConfigCase{"gravity_time_constant: inf", "gravity_time_constant"},
                    ConfigCase{"gyro_bias_time_constant: 0", "gyro_bias_time_constant"},
                    ConfigCase{"orientation_time_constant: 3", "gyro_bias_time_constant"},
                    ConfigCase{"anchor_time_constant: 0", "anchor_time_constant"},
                    ConfigCase{"foot_rotation_tolerance: 0", "foot_rotation_tolerance"},
                    ConfigCase{"light_load: -0.1", "light_load"},
                    ConfigCase{"light_load: 0.3", "full_load"},
                    ConfigCase{"full_load: 0.6", "full_load"}));

}  // namespace
}  // namespace poise
