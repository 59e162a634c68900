// Walking's defaults on robots of other sizes, and a foot that is let go on legs of any mass.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/robot/posture.h"
#include "components/robot_files/robot_files.h"
#include "components/step_planner/recovery_config.h"
#include "components/step_planner/walk_config.h"
#include "tests/robot/robot_test_support.h"

namespace poise {
namespace {

using robot::TestRobot;
using stepping::StepInput;
using stepping::Walk;
using stepping::WalkStage;

constexpr double kPeriod = 0.002;  // s

/// A robot that stands still whatever is asked for, but for the foot that swings.
class StillWorld {
 public:
  /// `stiffness`: N/m with which the foot presses where its reference is below the ground.
  StillWorld(const robot::RobotModel& model, const WalkConfig& config, double stiffness)
      : walk_(MakeWalk(config, ContactConfirmation(), model)), stiffness_(stiffness) {
    const double spacing = walk_.choice().limits().spacing;
    for (size_t i = 0; i < 2; ++i) {
      input_.sole[i] = Eigen::Translation3d(0, (i == 0 ? -0.5 : 0.5) * spacing, 0) *
                       Eigen::Isometry3d::Identity();
    }
    input_.com = {0, 0, robot::StandingHeight(model)};
    input_.com_height = input_.com.z();
    input_.allowed = true;
  }

  void Tick(const stepping::WalkCommand& command) {
    if (walk_.Update(input_, command)) {
      input_.in_contact = walk_.output().in_contact;
      for (size_t i = 0; i < 2; ++i) {
        input_.load[i] = 200;
        if (input_.in_contact[i]) continue;
        Eigen::Vector3d foot = walk_.output().swing.position;
        input_.load[i] = stiffness_ * std::max(-foot.z(), 0.0);
        foot.z() = std::max(foot.z(), 0.0);
        input_.sole[i].translation() = foot;
      }
    }
    input_.time += kPeriod;
  }

  /// s until `stage`; 10 when it does not come.
  double Until(WalkStage stage, const stepping::WalkCommand& command) {
    const double start = input_.time;
    while (walk_.stage() != stage && input_.time < start + 10) Tick(command);
    return input_.time - start;
  }
  const Walk& walk() const { return walk_; }

 private:
  Walk walk_;
  double stiffness_;
  StepInput input_;
};

const stepping::WalkCommand kAhead{{1, 0}, 0, true};  // m/s: approached, not reached

/// The paper's robot with its COM at four fifths of its height.
robot::RobotModel Crouched() {
  std::string text = robot::ReadWhole(robot::RobotPath(TestRobot::kDyros));
  const std::string height = "com_height: 0.75";
  text.replace(text.find(height), height.size(), "com_height: 0.6");
  return robot::LoadRobotTexts(text, robot::ReadWhole(robot::UrdfPath(TestRobot::kDyros)));
}

WalkConfig Enabled() {
  WalkConfig config;
  config.set_enabled(true);
  return config;
}

TEST(WalkDefaults, AreThePapersRobots) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const auto defaults = GroupDefault<StepMotion, WalkConfig>("motion");
  const Walk walk = MakeWalk(Enabled(), ContactConfirmation(), model);
  // To the bit.
  EXPECT_EQ(walk.period(),
            defaults.unload() + defaults.swing() + defaults.settle() + defaults.load());
}

// Dynamic similarity: lengths go with the height h, times with √(h/g).
TEST(WalkDefaults, AreOneWalkInUnitsOfGravityAndHeight) {
  const robot::RobotModel papers = robot::LoadTestRobot(TestRobot::kDyros);
  const robot::RobotModel other = Crouched();
  const double height = robot::StandingHeight(papers),
               ratio = robot::StandingHeight(other) / height;
  ASSERT_NEAR(ratio, 0.8, 1e-12);
  StillWorld first(papers, Enabled(), 1e5), second(other, Enabled(), 1e5);
  EXPECT_NEAR(second.walk().period(), std::sqrt(ratio) * first.walk().period(), 1e-12);
  // From a stand to the first lift-off, and the first step's length: accelerations are of g.
  EXPECT_NEAR(second.Until(WalkStage::kSwinging, kAhead),
              std::sqrt(ratio) * first.Until(WalkStage::kSwinging, kAhead), 2 * kPeriod);
  EXPECT_NEAR(second.walk().command().velocity.x(),
              std::sqrt(ratio) * first.walk().command().velocity.x(), 1e-12);

  WalkConfig given = Enabled();
  given.mutable_motion()->set_swing(0.5);
  const Walk walk = MakeWalk(given, ContactConfirmation(), other);
  EXPECT_NEAR(walk.period() - 0.5,
              std::sqrt(ratio) *
                  (first.walk().period() - GroupDefault<StepMotion, WalkConfig>("motion").swing()),
              1e-12);
}

// A leg presses with its mass at the foot times k_p of the foot's task: 6 kg and 625 1/s^2 of a
// small robot, 45 kg of a large one. Let go, the foot's reference comes back to the sole and goes
// down by turns; a light leg's load came to rest below `touch_load`, and the foot was never a
// contact.
TEST(WalkLanding, AFootThatIsLetGoCarriesUntilItCountsOnALegOfAnyMass) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const ContactConfirmation contact;
  for (const double stiffness : {600.0, 3750.0, 30e3}) {
    StillWorld world(model, Enabled(), stiffness);
    ASSERT_LT(world.Until(WalkStage::kTouching, kAhead), 3) << stiffness;
    const robot::Foot foot = world.walk().stepping_foot();
    EXPECT_LT(world.Until(WalkStage::kLoading, kAhead), 0.5) << stiffness;
    EXPECT_EQ(world.walk().num_steps(), 1) << stiffness;
    EXPECT_EQ(world.walk().stepping_foot(), Other(foot)) << stiffness;
  }
}

std::string RefusedField(const WalkConfig& config, const robot::RobotModel& model) {
  try {
    CheckFields(config, "walk.");
    CheckWalkConfig(config);
    MakeWalk(config, ContactConfirmation(), model);
  } catch (const ConfigError& error) {
    return error.field();
  }
  return "accepted";
}

TEST(WalkLimits, WhatTheLegsCannotDoIsRefused) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  struct Case {
    const char* field;
    double possible, impossible;
  };
  for (const Case& c :
       {Case{"motion.com_lowering", 0.08, 0.8}, Case{"motion.gap", 0.1, 0.5},
        Case{"motion.clearance", 0.14, 3}, Case{"longest", 0.3, 9}, Case{"widest", 0.2, 4}}) {
    WalkConfig config = Enabled();
    SetField(&config, c.field, std::to_string(c.possible));
    EXPECT_EQ(RefusedField(config, model), "accepted") << c.field;
    SetField(&config, c.field, std::to_string(c.impossible));
    EXPECT_EQ(RefusedField(config, model), std::string("walk.") + c.field);
  }
  RecoveryConfig recovery;
  recovery.mutable_motion()->set_clearance(3);
  EXPECT_THROW(MakeStepChoice(recovery, model), ConfigError);
  recovery.mutable_motion()->set_clearance(0.05);
  EXPECT_NO_THROW(MakeStepChoice(recovery, model));
  recovery.mutable_motion()->set_gap(0.5);
  EXPECT_THROW(MakeStepChoice(recovery, model), ConfigError);
}

/// The paper's robot with soles 60 mm wide and ankles that roll by up to `limit`, rad.
robot::RobotModel WithAnkles(double limit) {
  const auto replace = [](std::string* text, const std::string& before, const std::string& after,
                          size_t from) {
    text->replace(text->find(before, from), before.size(), after);
  };
  std::string urdf = robot::ReadWhole(robot::UrdfPath(TestRobot::kDyros));
  std::string text = robot::ReadWhole(robot::RobotPath(TestRobot::kDyros));
  for (const std::string joint : {"right_ankle_roll", "left_ankle_roll"}) {
    const std::string bound = std::to_string(limit);
    replace(&urdf, "lower=\"-0.6\" upper=\"0.6\"",
            "lower=\"-" + bound + "\" upper=\"" + bound + "\"",
            urdf.find("<joint name=\"" + joint));
    replace(&text, "width: 0.15", "width: 0.06", 0);
  }
  return robot::RobotModel(robot::LoadRobotTexts(text, urdf));
}

// Its ankles roll by 0.14 rad where a sole stands right below the COM, and 0.1 rad are kept off a
// limit.
TEST(WalkLimits, AStanceLegThatDoesNotComeBelowTheComIsNoFaultOfTheGap) {
  const robot::RobotModel model = WithAnkles(0.17);
  WalkConfig config = Enabled();
  config.mutable_motion()->set_gap(0.01);
  EXPECT_EQ(RefusedField(config, model), "accepted");
  config.set_quasi_static(true);
  EXPECT_EQ(RefusedField(config, WithAnkles(0.3)), "accepted");
  try {
    MakeWalk(config, ContactConfirmation(), model);
    ADD_FAILURE() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), "walk.quasi_static");
    const std::string text = error.what();
    for (const char* part : {"right_ankle_roll would be at ", "left_ankle_roll would be at ",
                             " of -0.170 to 0.170 rad", "0.1 rad are kept off", "Give false"}) {
      EXPECT_NE(text.find(part), std::string::npos) << text;
    }
    EXPECT_EQ(text.find("hip"), std::string::npos) << text;
  }
}

TEST(WalkCommands, HoldFromATimeAndANumberOfStepsOn) {
  WalkConfig config = Enabled();
  config.add_command()->set_time(1);
  config.mutable_command(0)->set_vx(0.1);
  config.add_command()->set_after_steps(20);
  config.mutable_command(1)->set_stop(true);
  EXPECT_EQ(RefusedField(config, robot::LoadTestRobot(TestRobot::kDyros)), "accepted");
  const WalkCommands commands(config);
  EXPECT_FALSE(commands.At(0.5, 0).stepping);
  EXPECT_TRUE(commands.At(1, 0).stepping);
  EXPECT_TRUE(commands.At(1000, 19).stepping);
  EXPECT_FALSE(commands.At(30, 20).stepping);
  // Both, where both are given.
  config.mutable_command(1)->set_time(60);
  EXPECT_TRUE(WalkCommands(config).At(59, 21).stepping);
  EXPECT_FALSE(WalkCommands(config).At(60, 21).stepping);
}

TEST(WalkCommands, OutOfOrderAreRefused) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  WalkConfig config = Enabled();
  config.add_command()->set_after_steps(-1);
  EXPECT_EQ(RefusedField(config, model), "walk.command[0].after_steps");
  config.mutable_command(0)->set_after_steps(5);
  config.add_command()->set_after_steps(4);
  EXPECT_EQ(RefusedField(config, model), "walk.command[1].after_steps");
  // As many steps, and no later: neither holds after the other.
  config.mutable_command(1)->set_after_steps(5);
  EXPECT_EQ(RefusedField(config, model), "walk.command[1].time");
  config.mutable_command(1)->set_time(2);
  EXPECT_EQ(RefusedField(config, model), "accepted");
}

TEST(WalkCommands, WhatNoOneCanWalkIsRefused) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [field, value] :
       {std::pair{"vx", nan}, {"vy", nan}, {"wz", nan}, {"time", nan}, {"time", -1.0}}) {
    WalkConfig config = Enabled();
    SetField(config.add_command(), field, std::to_string(value));
    EXPECT_EQ(RefusedField(config, model), std::string("walk.command[0].") + field);
  }
  WalkConfig config = Enabled();
  config.set_most_turn(1.6);  // a foot that points back
  EXPECT_EQ(RefusedField(config, model), "walk.most_turn");
}

TEST(WalkLimits, AVelocityThatNoStepReachesAndWhatHasNoEffectAreTold) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  WalkConfig config = Enabled();
  config.add_command()->set_vx(0.24);
  EXPECT_TRUE(WalkWarnings(config, model).empty());
  config.mutable_command(0)->set_vx(-0.5);
  ASSERT_EQ(WalkWarnings(config, model).size(), 1);
  EXPECT_NE(WalkWarnings(config, model)[0].find("walked at -0.248 m/s"), std::string::npos);
  config.mutable_command(0)->set_vx(0.1);
  config.set_slowest_swing(2);
  EXPECT_EQ(WalkWarnings(config, model).size(), 1);
  config.set_quasi_static(true);
  EXPECT_TRUE(WalkWarnings(config, model).empty());
}

TEST(WalkLimits, AsideAndInATurnOnlyEverySecondStepGoesOut) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  WalkConfig config = Enabled();
  StepMotion* motion = config.mutable_motion();
  motion->set_unload(0.2);
  motion->set_swing(0.5);
  motion->set_settle(0.1);
  motion->set_load(0.2);  // 1 s a step
  config.set_widest(0.2);
  config.set_most_turn(0.3);
  WalkCommandConfig* command = config.add_command();
  command->set_vy(0.1);
  command->set_wz(-0.15);
  EXPECT_TRUE(WalkWarnings(config, model).empty());
  command->set_vy(0.11);
  command->set_wz(-0.16);
  const std::vector<std::string> warnings = WalkWarnings(config, model);
  ASSERT_EQ(warnings.size(), 2);
  EXPECT_NE(warnings[0].find("vy=0.11 is walked at 0.1 m/s"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("wz=-0.16 is walked at -0.15 rad/s"), std::string::npos)
      << warnings[1];
}

TEST(WalkLimits, CommandsOfAWalkThatIsOffAreTold) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  WalkConfig config;
  EXPECT_TRUE(WalkWarnings(config, model).empty());
  config.add_command()->set_vx(0.1);
  ASSERT_EQ(WalkWarnings(config, model).size(), 1);
  EXPECT_NE(WalkWarnings(config, model)[0].find("walk.enabled=true"), std::string::npos);
}

}  // namespace
}  // namespace poise
