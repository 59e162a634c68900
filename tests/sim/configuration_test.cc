// Every configuration that cannot work is refused, naming its field.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/simulated_robot.h"
#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using ::testing::HasSubstr;

struct Refusal {
  const char* name;
  const char* text;
  const char* field;
  const char* problem;
};

class Refused : public ::testing::TestWithParam<Refusal> {};

TEST_P(Refused, NamesTheField) {
  const std::string text = GetParam().text;
  SimConfig config;
  if (text.rfind("start {", 0) == 0) {
    ParseTextProto(text, "test", &config);
  } else {
    config = StandingConfig(text);
  }
  try {
    const EngineSimulation simulation(PaperRobot(), config, kTick, 1);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), GetParam().field);
    EXPECT_THAT(error.problem(), HasSubstr(GetParam().problem));
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Configuration, Refused,
    ::testing::Values(
        Refusal{"StepDoesNotDivide", "step: 0.0015", "step", "does not divide"},
        Refusal{"StepTooLong", "step: 0.004", "step", "does not divide"},
        Refusal{"StepZero", "step: 0", "step", "greater than 0"},
        Refusal{"StepNan", "step: nan", "step", "greater than 0"},
        Refusal{"Joint", "start { nominal { joint: 'elbow' position: 1 } }",
                "start.nominal[0].joint", "no joint 'elbow'; use one of"},
        Refusal{"JointPosition",
                "start { nominal { joint: 'right_hip_yaw' } nominal { joint: 'right_hip_roll' "
                "position: inf } }",
                "start.nominal[1].position", "finite"},
        Refusal{"Spacing", "start { foot_spacing: -0.1 }", "start.foot_spacing", "greater than 0"},
        Refusal{"ComTooHigh", "start { com_height: 2 }", "start", ""},
        Refusal{"LeftFoot", "start { left_foot_height: -0.1 }", "start.left_foot_height",
                "0 or more"},
        Refusal{"GroundFriction", "ground { friction: -1 }", "ground.friction", "0 or more"},
        Refusal{"BlockWidth", "block { width: 0 }", "block.width", "greater than 0"},
        Refusal{"BlockStiffness", "block { stiffness: 0 }", "block.stiffness", "greater than 0"},
        Refusal{"BlockDamping", "block { damping: -1 }", "block.damping", "0 or more"},
        Refusal{"BlockTilt", "block { tilt_pitch: 1.2 }", "block.tilt_pitch", "-0.8 to 0.8"},
        Refusal{"BlockUnderTheFoot", "block { y: -0.1 height: 0.09 }", "block",
                "the right sole starts 0.090 m inside it"},
        Refusal{"PushLink", "push { start: 0 duration: 1 peak: 1 direction_x: 1 link: 'tail' }",
                "push[0].link", "no moving link 'tail'; use one of"},
        Refusal{"PushDirection", "push { start: 0 duration: 1 peak: 1 }", "push[0].direction_x",
                "no direction"},
        Refusal{"PushDirectionTooLong",
                "push { start: 0 duration: 1 peak: 1 direction_x: 1e300 direction_y: 1 }",
                "push[0].direction_x", "too long"},
        Refusal{"PushDuration", "push { start: 0 duration: 0 peak: 1 direction_x: 1 }",
                "push[0].duration", "greater than 0"},
        Refusal{"PushStart", "push { duration: 1 peak: 1 direction_x: 1 }", "push[0].start",
                "missing"},
        Refusal{"PushPeak", "push { start: 0 duration: 1 peak: nan direction_x: 1 }",
                "push[0].peak", "finite"},
        Refusal{"PushTwice",
                "push { start: 0 duration: 1 peak: 1 scaled_impulse: 0.1 direction_x: 1 }",
                "push[0].peak", "exclude each other"},
        Refusal{"PushAtBody",
                "push { start: 0 duration: 1 peak: 1 direction_x: 1 at_body: true point { z: 1 } }",
                "push[0].at_body", "in place of link and point"},
        Refusal{"FrictionStiffness", "friction_stiffness: 0", "friction_stiffness",
                "greater than 0"},
        Refusal{"FallTilt", "fall_tilt: 0", "fall_tilt", "greater than 0"},
        Refusal{"Lag", "drive_train { torque_lag: -1 }", "drive_train.torque_lag", "0 or more"},
        Refusal{"Resolution", "drive_train { current_resolution: nan }",
                "drive_train.current_resolution", "finite"},
        Refusal{"Backlash", "drive_train { backlash: -1 }", "drive_train.backlash", "0 or more"},
        Refusal{"GearDamping", "drive_train { gear_damping: inf }", "drive_train.gear_damping",
                "finite"},
        Refusal{"GearWithoutRotor", "rotor_inertia: false drive_train { gear_stiffness: 2e4 }",
                "drive_train.gear_stiffness", "set rotor_inertia: true"},
        Refusal{"BacklashWithoutRotor", "rotor_inertia: false drive_train { backlash: 1e-3 }",
                "drive_train.backlash", "set rotor_inertia: true"},
        Refusal{"Delay", "drive_train { sensor_delay: 0.0015 }", "drive_train.sensor_delay",
                "not a whole number"},
        Refusal{"DelayEndless", "drive_train { sensor_delay: 1e9 }", "drive_train.sensor_delay",
                "not a whole number"},
        Refusal{"HandStart", "hand { move_duration: 1 release: 2 }", "hand[0].start", "missing"},
        Refusal{"HandRelease", "hand { start: 1 move_duration: 1 release: 1.5 }", "hand[0].release",
                "before the move ends at 2 s"},
        Refusal{"HandLink", "hand { start: 1 move_duration: 1 release: 2 link: 'tail' }",
                "hand[0].link", "no moving link 'tail'"},
        Refusal{"HandStiffness",
                "hand { start: 1 move_duration: 1 release: 2 link: 'right_foot' damping: 1000 }",
                "hand[0].stiffness", "too stiff"},
        Refusal{"ModelErrorLink", "model_error { link: 'tail' }", "model_error[0].link",
                "no moving link 'tail'"},
        Refusal{"ModelErrorMass", "model_error { link: 'upper_body' mass_scale: -1 }",
                "model_error[0].mass_scale", "greater than 0"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Configuration, AnElasticGearNeedsEveryRotorsInertia) {
  const robot::RobotModel model =
      EditedRobot([](Robot* r) { r->mutable_motor(0)->set_rotor_inertia(0); });
  try {
    const EngineSimulation simulation(model, StandingConfig("drive_train { backlash: 1e-3 }"),
                                      kTick, 1);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), "drive_train.backlash");
    EXPECT_THAT(error.problem(), HasSubstr("joint 'right_hip_yaw'"));
  }
}

TEST(Configuration, TheStartIsTheRobotsStanceUnlessGiven) {
  const auto start = [](const std::string& text) {
    SimConfig config;
    ParseTextProto(text, "test", &config);
    return EngineSimulation(PaperRobot(), config, kTick, 1).truth();
  };
  const SimulationTruth stance = start("");
  EXPECT_NEAR(stance.com.z(), 0.75, 1e-7);
  EXPECT_GT(stance.state.joint_position.cwiseAbs().maxCoeff(), 0.5) << "knees bent";
  EXPECT_NEAR(start("start { com_height: 0.7 }").com.z(), 0.7, 1e-7);
  // Joints of its own bring a height of their own.
  const SimulationTruth deep = start(
      "start { nominal { joint: 'right_knee_pitch' position: 1.2 } "
      "nominal { joint: 'left_knee_pitch' position: 1.2 } "
      "nominal { joint: 'right_hip_pitch' position: -0.6 } "
      "nominal { joint: 'left_hip_pitch' position: -0.6 } "
      "nominal { joint: 'right_ankle_pitch' position: -0.6 } "
      "nominal { joint: 'left_ankle_pitch' position: -0.6 } }");
  EXPECT_LT(deep.com.z(), 0.72);
}

TEST(Configuration, TheDriveTrainIsTheRobotsUnlessGiven) {
  const robot::RobotModel model = EditedRobot([](Robot* r) {
    r->mutable_drive_train()->set_gear_stiffness(8000);
    r->mutable_drive_train()->set_backlash(0.001);
  });
  const auto of = [&](const std::string& text) {
    SimConfig config;
    ParseTextProto(text, "test", &config);
    return SimulatedDriveTrain(model, config);
  };
  EXPECT_EQ(of("").gear_stiffness(), 8000);
  EXPECT_EQ(of("drive_train { backlash: 0 }").backlash(), 0);
  EXPECT_EQ(of("drive_train { backlash: 0 }").gear_stiffness(), 8000);
  EXPECT_EQ(of("robot_drive_train: false drive_train { torque_lag: 1 }").gear_stiffness(), 0);
  EXPECT_EQ(of("robot_drive_train: false drive_train { torque_lag: 1 }").torque_lag(), 1);
}

TEST(Configuration, StepsPerTickAreExact) {
  SimConfig config = StandingConfig();
  config.set_step(0.0005);
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  for (int i = 0; i < 1000; ++i) simulation.Advance();
  EXPECT_NEAR(simulation.time(), 2, 1e-12);
}

TEST(Configuration, ModelErrorChangesTheSimulatedRobotOnly) {
  const robot::RobotModel model = PaperRobot();
  const EngineSimulation simulation(
      model, StandingConfig("model_error { link: 'upper_body' mass_scale: 1.1 }"), kTick, 1);
  const double body = model.bodies()[0].mass;
  EXPECT_NEAR(simulation.model().total_mass(), model.total_mass() + 0.1 * body, 1e-9);
  EXPECT_NEAR(simulation.truth().foot_wrench[0][2] + simulation.truth().foot_wrench[1][2],
              simulation.model().total_mass() * robot::kGravity, 1e-8);
}

}  // namespace
}  // namespace poise
