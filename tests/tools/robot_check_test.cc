// What `poise robot check` says, against statics and the pendulum by hand.
#include "tools/robot/robot_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <sstream>

#include "components/framework/configuration/configuration.h"
#include "components/robot/dynamics.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "tools/cli/output_style.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

fs::path Robots() { return fs::path(POISE_SOURCE_DIR) / "deploy" / "robots"; }

const RobotCheck& Paper() {
  static const RobotCheck check = CheckRobot(Robots() / "dyros" / "dyros_legs.pbtxt");
  return check;
}

const RobotCheck& Heron() {
  static const RobotCheck check = CheckRobot(Robots() / "heron" / "heron.pbtxt");
  return check;
}

/// A check of the paper's robot with its text changed.
RobotCheck Edited(const std::string& what, const std::string& instead) {
  const fs::path folder = fs::path(testing::TempDir()) / "poise_robot_check";
  fs::create_directories(folder);
  fs::copy_file(Robots() / "dyros" / "dyros_legs.urdf", folder / "dyros_legs.urdf",
                fs::copy_options::overwrite_existing);
  std::string text = ReadFile((Robots() / "dyros" / "dyros_legs.pbtxt").string());
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos);
  text.replace(at, what.size(), instead);
  const fs::path file = folder / "dyros_legs.pbtxt";
  std::ofstream(file) << text;
  return CheckRobot(file);
}

TEST(RobotCheck, PushesAreThePendulumsToTheSolesEdges) {
  const RobotCheck& check = Paper();
  EXPECT_NEAR(check.com_height, 0.75, 1e-7);
  EXPECT_NEAR(check.frequency, std::sqrt(9.80665 / 0.75), 1e-6);
  ASSERT_EQ(check.pushes.size(), 16u);
  const double momentum = check.model.total_mass() * check.frequency;
  // Soles of 0.30 x 0.15 m, the COM midway between them or above one's centre.
  EXPECT_NEAR(check.pushes[0].both, momentum * 0.15, 1e-4);
  EXPECT_NEAR(check.pushes[4].both, momentum * (0.5 * check.foot_spacing + 0.075), 1e-4);
  EXPECT_NEAR(check.pushes[12].right, momentum * 0.075, 1e-4);
  EXPECT_NEAR(check.pushes[8].left, momentum * 0.15, 1e-4);
  // Obliquely over the long edge or the short one, whichever is nearer.
  EXPECT_NEAR(check.pushes[2].right, momentum * 0.075 * std::numbers::sqrt2, 1e-4);
}

TEST(RobotCheck, MassesInGramsAndMarginsAtTheirCapsAreTold) {
  EXPECT_NE(FormatRobotCheck(Paper(), 120).find("≥ 5 ticks"), std::string::npos);
  const RobotCheck heavy =
      Edited("foot {",
             "repair { link: \"upper_body\" mass: 22630 inertia { ixx: 9 iyy: 9 izz: 9 } } foot {");
  EXPECT_TRUE(std::ranges::any_of(heavy.defects, [](const std::string& defect) {
    return defect.find("masses that are in g") != std::string::npos;
  })) << testing::PrintToString(heavy.defects);
}

TEST(RobotCheck, AKneeBearsMoreOnOneFootThanOnBoth) {
  for (const RobotCheck* check : {&Paper(), &Heron()}) {
    ASSERT_TRUE(check->stands_on_one_foot);
    for (const JointLoad& load : check->loads) {
      if (load.joint.find("knee") == std::string::npos) continue;
      EXPECT_GT(load.single_support, 1.5 * load.double_support);
      // The whole weight a quarter of a metre before the knee would be a deep crouch.
      EXPECT_LT(load.single_support, check->model.total_mass() * robot::kGravity * 0.25);
    }
  }
}

// The stance is symmetric: each leg bears half. Then virtual work about the knees' common axis: the
// weight above them turns about it as both knees' torques together do.
TEST(RobotCheck, TorqueOnBothFeetIsThatOfVirtualWork) {
  const RobotCheck& check = Paper();
  const robot::RobotModel& model = check.model;
  robot::RobotData data(model);
  robot::ComputeKinematics(model, check.stance, &data);
  const auto joint = static_cast<size_t>(model.FindJoint("right_knee_pitch"));
  const auto body = static_cast<size_t>(model.joints()[joint].body);
  const Vector3d knee = data.base_position + data.body_position[body];
  double moment = 0;
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const std::string& name = model.bodies()[b].name;
    if (name.find("shank") != std::string::npos || name.find("ankle") != std::string::npos ||
        name.find("foot") != std::string::npos) {
      continue;
    }
    const Vector3d com =
        data.base_position + data.body_position[b] + data.body_rotation[b] * model.bodies()[b].com;
    moment += model.bodies()[b].mass * robot::kGravity * (com.x() - knee.x());
  }
  // Horizontal forces of the ground, which cancel between the feet, do not turn about an axis in y.
  const double knees =
      check.loads[joint].double_support +
      check.loads[static_cast<size_t>(model.FindJoint("left_knee_pitch"))].double_support;
  EXPECT_NEAR(knees, std::abs(moment), 1e-6);
}

TEST(RobotCheck, SolesHaveTheirAreas) {
  EXPECT_NEAR(Paper().soles[0].area, 0.30 * 0.15, 1e-12);
  EXPECT_EQ(Paper().soles[0].corners.size(), 4u);
  // The polygon has strips between its corners: trapezoids from heel to ball, and to the toe.
  const double area = 0.11 * (0.072 + 0.092) / 2 + 0.07 * 0.092 + 0.04 * (0.092 + 0.072) / 2;
  EXPECT_NEAR(Heron().soles[0].area, area, 1e-12);
  EXPECT_NEAR(Heron().soles[1].area, area, 1e-12);
  EXPECT_EQ(Heron().soles[1].corners.size(), 8u);
}

TEST(RobotCheck, ReachIsWithinTheLegsLength) {
  for (const RobotCheck* check : {&Paper(), &Heron()}) {
    for (const double reach :
         {check->reach.forward, check->reach.back, check->reach.outward, check->reach.up}) {
      EXPECT_GT(reach, 0.05);
      EXPECT_LT(reach, 1.2);
    }
    EXPECT_LT(check->reach.up, check->com_height);
  }
}

TEST(RobotCheck, BothOfTheHousesRobotsAreGood) {
  for (const RobotCheck* check : {&Paper(), &Heron()}) {
    EXPECT_TRUE(check->ok()) << FormatRobotCheck(*check, 80);
  }
}

TEST(RobotCheck, NamesWhatIsTooWeakAndWhatStandsAtItsEnd) {
  const RobotCheck weak = Edited("torque_constant: 0.10", "torque_constant: 0.02");
  ASSERT_FALSE(weak.ok());
  EXPECT_NE(FormatRobotCheck(weak, 200).find("knee_pitch needs"), std::string::npos)
      << FormatRobotCheck(weak, 200);
}

constexpr char kName[] = "name: \"dyros_legs\"\n";

std::string Limit(const std::string& joint, const std::string& what) {
  return std::string(kName) + "limit { joint: \"" + joint + "\" " + what + " }\n";
}

TEST(RobotCheck, ForetellsWhatAStepTakes) {
  const RobotCheck& check = Paper();
  for (const JointLoad& load : check.loads) {
    // The true torque of both knees in the scenario walk, ODE, at 0.1 m/s.
    constexpr double kWalks = 106.0;  // N·m
    if (load.joint.find("knee") != std::string::npos) {
      EXPECT_NEAR(load.step, kWalks, 0.1 * kWalks) << load.joint;
      EXPECT_GT(load.step_rms, load.double_support);
      EXPECT_LT(load.step_rms, load.step);
      EXPECT_GT(load.step_velocity, 0.3);
    }
  }
  // It turns by 0.07 rad in a swing of 0.32 s: 15/8 of the mean speed at least, of one hip.
  double yaw = 0;
  for (const JointLoad& load : check.loads) {
    if (load.joint.find("hip_yaw") != std::string::npos) yaw = std::max(yaw, load.step_velocity);
  }
  constexpr double kLeast = 0.07 / 0.32 * 15 / 8;
  EXPECT_GT(yaw, 0.95 * kLeast);
  EXPECT_LT(yaw, 2 * kLeast);
  const RobotCheck slow = Edited(kName, Limit("right_hip_yaw", "velocity: 0.3"));
  EXPECT_NE(FormatRobotCheck(slow, 300).find("joint right_hip_yaw turns at"), std::string::npos);
}

TEST(RobotCheck, ForetellsAMotorThatGetsTooHot) {
  double standing = 0, knee = 0;
  for (const JointLoad& load : Paper().loads) {
    standing = std::max(standing, load.double_support);
    if (load.joint == "right_knee_pitch") knee = load.step_rms;
  }
  ASSERT_GT(knee, 1.2 * standing);
  const double rated = 1.1 * standing * 15 / Paper().loads[0].rated;  // A
  const RobotCheck hot = Edited("rated_current: 15", fmt::format("rated_current: {}", rated));
  const std::string text = FormatRobotCheck(hot, 300);
  EXPECT_NE(text.find("root mean square"), std::string::npos) << text;
  EXPECT_EQ(text.find("to stand on both feet"), std::string::npos) << text;
}

TEST(RobotCheck, WhereNoPostureIsOnOneFootNoTorqueIsGiven) {
  const RobotCheck stiff = Edited(
      kName, Limit("right_hip_roll", "lower: -0.02 upper: 0.02") +
                 Limit("left_hip_roll", "lower: -0.02 upper: 0.02").substr(sizeof kName - 1));
  EXPECT_FALSE(stiff.stands_on_one_foot);
  EXPECT_NE(FormatRobotCheck(stiff, 300).find("–"), std::string::npos);
  EXPECT_TRUE(
      nlohmann::json::parse(RobotCheckJson(stiff).dump())["torque"][0]["single_support"].is_null());
}

// What the maker's file has beyond a robot is told, and is no defect of it.
TEST(RobotCheck, WhatIsLeftOutIsNoDefect) {
  const fs::path folder = fs::path(testing::TempDir()) / "poise_left_out";
  fs::create_directories(folder);
  for (const char* end : {".pbtxt", ".xml"}) {
    std::string text = ReadFile((Robots() / "heron" / "heron").string() + end);
    if (std::string(end) == ".xml") {
      text.insert(text.rfind("</actuator>"), "<motor name=\"dummy\" joint=\"nowhere\"/>");
    } else {
      text = std::regex_replace(text, std::regex("urdf: \"[^\"]*\""), "mjcf: \"heron.xml\"");
      // MJCF has no limits of velocity.
      text += "limit {";
      const std::string xml = ReadFile((Robots() / "heron" / "heron.xml").string());
      const std::regex joint("<joint name=\"([^\"]*)\"");
      for (std::sregex_iterator at(xml.begin(), xml.end(), joint), end; at != end; ++at) {
        text += " joint: \"" + at->str(1) + "\"";
      }
      text += " velocity: 20 }\n";
    }
    std::ofstream(folder / (std::string("heron") + end)) << text;
  }
  const RobotCheck check = CheckRobot(folder / "heron.pbtxt");
  EXPECT_TRUE(check.ok()) << FormatRobotCheck(check, 200);
  ASSERT_EQ(check.left_out.size(), 1u);
  EXPECT_NE(FormatRobotCheck(check, 300).find("'dummy' moves no joint"), std::string::npos);
}

TEST(RobotCheck, AMakersFileInPlaceOfARobotIsNamed) {
  try {
    FindFile("robots", "my/mine.urdf", fs::path());
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("poise robot import my/mine.urdf"), std::string::npos);
  }
}

// A scenario that does not say what it is and has its graph's name is not taken for the graph.
TEST(RobotCheck, AFileOfAnotherKindsFolderIsNotMeant) {
  const fs::path scenarios = fs::path(testing::TempDir()) / "poise_kinds" / "scenarios";
  fs::create_directories(scenarios);
  std::ofstream(scenarios / "balance.pbtxt") << "graph: \"balance\"\n";
  const auto graph = LookForFile("graphs", "balance", scenarios);
  ASSERT_TRUE(graph);
  EXPECT_EQ(graph->parent_path().filename(), "graphs");
  EXPECT_EQ(LookForFile("scenarios", "balance", scenarios), scenarios / "balance.pbtxt");
  fs::remove_all(scenarios.parent_path());
}

TEST(RobotCheck, AGuessedSoleIsTold) {
  const RobotCheck check = Edited("length: 0.30", "length: 0.30 guessed: true");
  const nlohmann::ordered_json soles = RobotCheckJson(check)["soles"];
  EXPECT_TRUE(soles[0]["guessed"].get<bool>());
  EXPECT_FALSE(soles[1]["guessed"].get<bool>());
  const std::string text = FormatRobotCheck(check, 300);
  const size_t told = text.find("from the origin: a guess");
  EXPECT_GT(told, text.find("right: 4 corners"));
  EXPECT_LT(told, text.find("left: 4 corners"));
}

TEST(RobotCheck, FitsATerminalAndSaysTheSameAsJson) {
  std::istringstream text(FormatRobotCheck(Heron(), 80));
  for (std::string line; std::getline(text, line);) EXPECT_LE(DisplayWidth(line), 80) << line;
  const nlohmann::ordered_json json = RobotCheckJson(Heron());
  EXPECT_EQ(json["torque"].size(), 29u);
  EXPECT_EQ(json["push"].size(), 16u);
  EXPECT_NEAR(json["mass"].get<double>(), 48.4, 1e-9);
  EXPECT_TRUE(json["defects"].empty());
}

}  // namespace
}  // namespace poise
