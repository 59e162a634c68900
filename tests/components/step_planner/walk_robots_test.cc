// Walking's defaults on robots of other sizes, and what their legs cannot do.
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
using stepping::QuasiStaticWalk;
using stepping::Stage;
using stepping::StepInput;

constexpr double kPeriod = 0.002;   // s
constexpr double kStiffness = 1e5;  // N/m with which a foot presses below the ground

/// A robot whose COM is where it is wanted, at rest, and whose foot goes where the swing says.
class StillWorld {
 public:
  StillWorld(const robot::RobotModel& model, const WalkConfig& config)
      : walk_(MakeQuasiStaticWalk(config, ContactConfirmation(), model)) {
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
      input_.com.head<2>() = walk_.wanted();
      input_.in_contact = walk_.output().in_contact;
      for (size_t i = 0; i < 2; ++i) {
        input_.load[i] = 200;
        if (input_.in_contact[i]) continue;
        Eigen::Vector3d foot = walk_.output().swing.position;
        input_.load[i] = kStiffness * std::max(-foot.z(), 0.0);
        foot.z() = std::max(foot.z(), 0.0);
        input_.sole[i].translation() = foot;
      }
    }
    input_.time += kPeriod;
  }

  /// s until `stage`; 10 when it does not come.
  double Until(Stage stage, const stepping::WalkCommand& command) {
    const double start = input_.time;
    while (walk_.stage() != stage && input_.time < start + 10) Tick(command);
    return input_.time - start;
  }
  const QuasiStaticWalk& walk() const { return walk_; }

 private:
  QuasiStaticWalk walk_;
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

/// A quasi-static walk with the shipped numbers.
std::vector<std::string> Warnings(const WalkConfig& config, const robot::RobotModel& model) {
  return WalkWarnings(
      config, model, config.quasi_static() ? MakeWalkChoice(config, model) : MakeStepChoice(model));
}

WalkConfig Enabled() {
  WalkConfig config;
  config.set_enabled(true);
  config.set_quasi_static(true);
  return config;
}

TEST(WalkDefaults, AreThePapersRobots) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const QuasiStaticWalk walk = MakeQuasiStaticWalk(Enabled(), ContactConfirmation(), model);
  EXPECT_EQ(walk.period(), 0.8 + 1.1 + 0.2 + 0.8);  // to the bit
}

// Dynamic similarity: lengths go with the height h, times with √(h/g).
TEST(WalkDefaults, AreOneWalkInUnitsOfGravityAndHeight) {
  const robot::RobotModel papers = robot::LoadTestRobot(TestRobot::kDyros);
  const robot::RobotModel other = Crouched();
  const double height = robot::StandingHeight(papers),
               ratio = robot::StandingHeight(other) / height;
  ASSERT_NEAR(ratio, 0.8, 1e-12);
  StillWorld first(papers, Enabled()), second(other, Enabled());
  EXPECT_NEAR(second.walk().period(), std::sqrt(ratio) * first.walk().period(), 1e-12);
  // From a stand to the first lift-off, and the first step's length: accelerations are of g.
  EXPECT_NEAR(second.Until(Stage::kSwinging, kAhead),
              std::sqrt(ratio) * first.Until(Stage::kSwinging, kAhead), 2 * kPeriod);
  EXPECT_NEAR(second.walk().command().velocity.x(),
              std::sqrt(ratio) * first.walk().command().velocity.x(), 1e-12);
}

std::string RefusedField(const WalkConfig& config, const robot::RobotModel& model) {
  try {
    CheckFields(config, "walk.");
    CheckWalkConfig(config);
    MakeQuasiStaticWalk(config, ContactConfirmation(), model);
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
       {Case{"gap", 0.1, 0.5}, Case{"clearance", 0.14, 3}, Case{"longest", 0.3, 9}}) {
    WalkConfig config = Enabled();
    SetField(&config, c.field, std::to_string(c.possible));
    EXPECT_EQ(RefusedField(config, model), "accepted") << c.field;
    SetField(&config, c.field, std::to_string(c.impossible));
    EXPECT_EQ(RefusedField(config, model), std::string("walk.") + c.field);
  }
}

/// The paper's robot whose hips turn a leg back by at most `limit`, rad.
robot::RobotModel WithHips(double limit) {
  std::string urdf = robot::ReadWhole(robot::UrdfPath(TestRobot::kDyros));
  const std::string bound = "lower=\"-1.9\" upper=\"0.7\"";
  for (size_t at = urdf.find(bound); at != std::string::npos; at = urdf.find(bound)) {
    urdf.replace(at, bound.size(), "lower=\"-1.9\" upper=\"" + std::to_string(limit) + "\"");
  }
  return robot::LoadRobotTexts(robot::ReadWhole(robot::RobotPath(TestRobot::kDyros)), urdf);
}

// A default that the legs cannot do is no one's mistake: what they can do is walked. The same
// number is one where it is given.
TEST(WalkLimits, ADefaultThatTheLegsCannotDoIsNoMistake) {
  int told = 0;
  for (double limit = 0.7; limit > -0.5; limit -= 0.05) {
    const robot::RobotModel model = WithHips(limit);
    WalkConfig config = Enabled();
    if (RefusedField(config, model) != "accepted") break;
    config.set_longest(config.longest());
    const std::string field = RefusedField(config, model);
    EXPECT_TRUE(field == "accepted" || field == "walk.longest") << field << " at " << limit;
    told += field == "walk.longest" ? 1 : 0;
  }
  EXPECT_GT(told, 0);
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
  config.set_gap(0.01);
  EXPECT_EQ(RefusedField(config, WithAnkles(0.3)), "accepted");
  try {
    MakeQuasiStaticWalk(config, ContactConfirmation(), model);
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
}

// 0.25 m in 2.9 s, where it is quasi-static; with the steps of a recovery what the legs span, in
// times of some 0.36 s.
TEST(WalkLimits, AVelocityThatNoStepReachesAndWhatHasNoEffectAreTold) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  WalkConfig config = Enabled();
  config.add_command()->set_vx(0.08);
  EXPECT_TRUE(Warnings(config, model).empty());
  config.mutable_command(0)->set_vx(-0.5);
  ASSERT_EQ(Warnings(config, model).size(), 1);
  EXPECT_NE(Warnings(config, model)[0].find("walked at -0.0862 m/s"), std::string::npos);
  config.set_longest(0.2);
  config.set_gap(0.05);
  config.set_quasi_static(false);
  const std::vector<std::string> warnings = Warnings(config, model);
  ASSERT_EQ(warnings.size(), 2);
  EXPECT_NE(warnings[0].find("walk.longest has no effect"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("walk.gap has no effect"), std::string::npos) << warnings[1];
  config.mutable_command(0)->set_vx(5);
  EXPECT_EQ(Warnings(config, model).size(), 3);
}

TEST(WalkLimits, AsideAndInATurnOnlyEverySecondStepGoesOut) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  WalkConfig config = Enabled();
  // 0.12 m and 0.35 rad in two steps of 2.9 s.
  WalkCommandConfig* command = config.add_command();
  command->set_vy(0.0206);
  command->set_wz(-0.0603);
  EXPECT_TRUE(Warnings(config, model).empty());
  command->set_vy(0.021);
  command->set_wz(-0.061);
  const std::vector<std::string> warnings = Warnings(config, model);
  ASSERT_EQ(warnings.size(), 2);
  EXPECT_NE(warnings[0].find("vy=0.021 is walked at 0.0207 m/s"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("wz=-0.061 is walked at -0.0603 rad/s"), std::string::npos)
      << warnings[1];
}

TEST(WalkLimits, CommandsOfAWalkThatIsOffAreTold) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  WalkConfig config;
  EXPECT_TRUE(Warnings(config, model).empty());
  config.add_command()->set_vx(0.1);
  ASSERT_EQ(Warnings(config, model).size(), 1);
  EXPECT_NE(Warnings(config, model)[0].find("walk.enabled=true"), std::string::npos);
}

}  // namespace
}  // namespace poise
