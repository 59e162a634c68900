// What a scenario changes about the robot that is simulated.
#include "sim/simulated_robot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/framework/configuration/field_rules.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

SimConfig Config(const std::string& text) {
  SimConfig config;
  ParseTextProto(text, "test", &config);
  return config;
}

TEST(SimulatedMotors, StayTheRobotFilesWithoutChange) {
  const robot::RobotModel robot = PaperRobot();
  const auto motors = SimulatedMotors(robot, Config(""));
  for (size_t j = 0; j < motors.size(); ++j) {
    EXPECT_EQ(motors[j].coulomb_friction, robot.motors()[j].coulomb_friction);
    EXPECT_EQ(motors[j].reflected_inertia, robot.motors()[j].reflected_inertia);
  }
}

TEST(SimulatedMotors, ChangeForAllAndForNamedJoints) {
  const robot::RobotModel robot = PaperRobot();
  const auto motors = SimulatedMotors(
      robot, Config("motor_change { coulomb_friction: 1 static_friction: 1.5 rotor_inertia: 1e-4 }"
                    "motor_change { joint: 'left_knee_pitch' viscous_friction: 3 "
                    "torque_constant: 0.09 }"));
  const auto knee = static_cast<size_t>(robot.FindJoint("left_knee_pitch"));
  for (size_t j = 0; j < motors.size(); ++j) {
    EXPECT_EQ(motors[j].coulomb_friction, 1);
    EXPECT_EQ(motors[j].static_friction, 1.5);
    EXPECT_NEAR(motors[j].reflected_inertia, 1e-4 * 50 * 50, 1e-12);  // gear 1:50
    EXPECT_EQ(motors[j].viscous_friction, j == knee ? 3 : 0.5);
    EXPECT_NEAR(motors[j].torque_per_ampere(), j == knee ? 4.5 : 5, 1e-12);
  }
}

TEST(SimulatedMotors, CoulombFrictionAloneBringsNoStribeckPeak) {
  const robot::RobotModel flat = EditedRobot([](Robot* description) {
    for (auto& motor : *description->mutable_motor()) motor.clear_static_friction();
  });
  for (const double friction : {0.5, 5.0}) {
    SimConfig config;
    config.add_motor_change()->set_coulomb_friction(friction);
    EXPECT_EQ(SimulatedMotors(flat, config)[0].static_friction, friction);
  }
}

struct Refusal {
  const char* text;
  const char* field;
};

class RefusedChange : public ::testing::TestWithParam<Refusal> {};

TEST_P(RefusedChange, NamesTheField) {
  try {
    const robot::RobotModel robot = PaperRobot();
    const SimConfig config = Config(GetParam().text);
    CheckFields(config);  // as a simulation does first
    SimulatedMotors(robot, config);
    SimulatedNoise(robot, config);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), GetParam().field);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Changes, RefusedChange,
    ::testing::Values(
        Refusal{"motor_change { joint: 'elbow' }", "motor_change[0].joint[0]"},
        Refusal{"motor_change { gear_ratio: 40 }", "motor_change[0].gear_ratio"},
        Refusal{"motor_change { encoder_counts: 4 }", "motor_change[0].encoder_counts"},
        Refusal{"motor_change { rotor_inertia: -1 }", "motor_change[0].rotor_inertia"},
        Refusal{"motor_change {} motor_change { coulomb_friction: nan }",
                "motor_change[1].coulomb_friction"},
        Refusal{"motor_change { coulomb_friction: 3 static_friction: 2 }",
                "motor_change[0].static_friction"},
        Refusal{"motor_change { torque_constant: 0 }", "motor_change[0].torque_constant"},
        Refusal{"motor_change { stribeck_velocity: 0 }", "motor_change[0].stribeck_velocity"},
        Refusal{"imu_change { gyro_noise: -1 }", "imu_change.gyro_noise"},
        Refusal{"imu_change { link: 'x' }", "imu_change.link"},
        Refusal{"force_noise: inf", "force_noise"}, Refusal{"moment_noise: -2", "moment_noise"},
        Refusal{"push_sensor_noise: -1", "push_sensor_noise"}));

TEST(SimulatedNoise, ChangesWhatIsGivenAndIsSilentWhenOff) {
  const robot::RobotModel robot = PaperRobot();
  const SensorNoise noise =
      SimulatedNoise(robot, Config("imu_change { gyro_bias: 0.01 } force_noise: 3"));
  EXPECT_EQ(noise.gyro_bias, 0.01);
  EXPECT_EQ(noise.force, 3);
  EXPECT_EQ(noise.gyro, robot.imu().gyro_noise);
  EXPECT_EQ(noise.moment, robot.moment_noise());
  const SensorNoise off = SimulatedNoise(robot, Config("force_noise: 3 sensor_noise: false"));
  EXPECT_EQ(off.force, 0);
  EXPECT_EQ(off.gyro_bias, 0);
  EXPECT_EQ(off.push, 0);
}

}  // namespace
}  // namespace poise
