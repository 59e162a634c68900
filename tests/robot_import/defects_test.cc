// What is wrong with a file is found, named and repaired; what cannot balance is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <fstream>
#include <random>
#include <regex>

#include "components/robot/posture.h"
#include "components/robot_files/robot_files.h"
#include "tests/robot/robot_test_support.h"
#include "tests/robot_import/import_support.h"
#include "tests/test_seed.h"
#include "tools/robot_import/inertia_repair.h"

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::HasSubstr;

std::string Defects(const RobotImport& imported) {
  std::string text;
  for (const Defect& defect : imported.defects) text += defect.what + " -> " + defect.done + "\n";
  return text;
}

TEST(Defects, HiddenRotorIsTakenOutOfTheLinkAndGivenToTheMotor) {
  Biped changes;
  changes.shin_rotor = 0.4;
  const std::string maker = SimpleBiped(changes);
  const RobotImport imported = ImportText("rotor", maker);
  EXPECT_THAT(Defects(imported), HasSubstr("link 'right_shin' hides a rotor"));
  EXPECT_THAT(Defects(imported), HasSubstr("link 'left_shin' hides a rotor"));
  const Motor& motor = MotorOf(imported.robot, "left_knee_joint");
  // The link's own moment about the axis can be anything from 0.026 to 0.034: half of that is
  // unknown.
  const double reflected = motor.rotor_inertia() * motor.gear_ratio() * motor.gear_ratio();
  EXPECT_NEAR(reflected, changes.shin_rotor, kShinInertia[2]);
  // The joint feels what the maker's file says.
  const auto inertia_at_knee = [](const robot::RobotModel& model) {
    const int knee = model.FindJoint("left_knee_joint");
    return robot::Evaluate(model, robot::RobotState(model.num_joints()))
        .mass_matrix(6 + knee, 6 + knee);
  };
  const robot::RobotModel with = robot::MakeRobot(imported.robot, maker);
  const RobotImport plain = ImportText("plain", SimpleBiped());
  Robot without = plain.robot;
  for (Motor& m : *without.mutable_motor()) m.set_rotor_inertia(0);
  EXPECT_NEAR(inertia_at_knee(with),
              inertia_at_knee(robot::MakeRobot(without, SimpleBiped())) + 0.4, 1e-6);
}

TEST(Defects, NoRotorIsSeenWhereThereIsNone) {
  EXPECT_FALSE(HiddenRotor(Vector3d(0.03, 0.029, 0.004).asDiagonal(), Vector3d::UnitY()));
  // The excess lies across the axis.
  EXPECT_FALSE(HiddenRotor(Vector3d(0.03, 0.5, 0.004).asDiagonal(), Vector3d::UnitZ()));
  EXPECT_EQ(ImportText("clean", SimpleBiped()).defects.size(), 0u);
}

TEST(Defects, NearestPhysicalInertiaIsPhysicalAndNearest) {
  std::mt19937 random(TestSeed(3));
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    Matrix3d m;
    for (double& x : m.reshaped()) x = normal(random);
    Matrix3d broken = m * m.transpose();
    const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(broken);
    Vector3d moments = axes.eigenvalues();
    moments[2] = moments[0] + moments[1] + std::abs(normal(random));
    const auto with = [&](const Vector3d& d) -> Matrix3d {
      return axes.eigenvectors() * d.asDiagonal() * axes.eigenvectors().transpose();
    };
    broken = with(moments);
    const Matrix3d nearest = NearestPhysical(broken);
    const Vector3d found = Eigen::SelfAdjointEigenSolver<Matrix3d>(nearest).eigenvalues();
    EXPECT_GE(found[0] + found[1], found[2] * (1 - 1e-12));
    EXPECT_GT(found[0], 0);
    EXPECT_NEAR((NearestPhysical(nearest) - nearest).norm(), 0, 1e-8 * nearest.norm());
    // No physical one that is drawn lies nearer.
    for (int k = 0; k < 200; ++k) {
      Vector3d other = found + 0.1 * Vector3d(normal(random), normal(random), normal(random));
      if (other.minCoeff() < 0 || 2 * other.maxCoeff() > other.sum()) continue;
      EXPECT_GE((with(other) - broken).norm(), (nearest - broken).norm() * (1 - 1e-6));
    }
  }
}

TEST(Defects, AllAreListedAtOnce) {
  std::string text = SimpleBiped();
  const auto replace = [&](const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  };
  // A point with noise, whose mirror image has an inertia; a broken one; no torque; no range.
  replace(
      "<mass value='3'/><inertia ixx='0.03' ixy='0' ixz='0' iyy='0.029' iyz='0' izz='0.004'/>",
      "<mass value='3'/><inertia ixx='1e-20' ixy='0' ixz='2e-20' iyy='-1e-20' iyz='0' izz='0'/>");
  replace("<mass value='20'/><inertia ixx='0.3' ixy='0' ixz='0' iyy='0.25'",
          "<mass value='20'/><inertia ixx='0.9' ixy='0' ixz='0' iyy='0.25'");
  replace("effort='100' velocity='10'", "effort='0' velocity='10'");
  const RobotImport imported = ImportText("many", text);
  const std::string defects = Defects(imported);
  EXPECT_THAT(defects, HasSubstr("link 'left_shin' has noise"));
  EXPECT_THAT(defects, HasSubstr("that of its mirror image 'right_shin'"));
  EXPECT_THAT(defects, HasSubstr("link 'base': inertia breaks the triangle inequality"));
  EXPECT_THAT(defects, HasSubstr("1 joint has no torque limit"));
  const robot::RobotModel model = robot::MakeRobot(imported.robot, text);
  EXPECT_NEAR(model.bodies()[static_cast<size_t>(model.FindFrame("left_shin")->body)].inertia(1, 1),
              kShinInertia[1], 1e-12);
}

TEST(Defects, ReversedLimitsAreSwapped) {
  std::string text = SimpleBiped();
  const size_t joint = text.find("<joint name='left_knee"), lower = text.find("lower='", joint);
  const size_t end = text.find(" effort", lower);
  text.replace(lower, end - lower, "lower='0.6' upper='-0.4'");
  const RobotImport imported = ImportText("reversed", text);
  EXPECT_THAT(Defects(imported), HasSubstr("1 joint has a lower limit above the upper one"));
  const robot::RobotModel model = robot::MakeRobot(imported.robot, text);
  EXPECT_EQ(std::ranges::count_if(model.joints(),
                                  [](const auto& j) { return j.lower == -0.4 && j.upper == 0.6; }),
            1);
}

TEST(Defects, CoupledPrismaticAndFingerJointsAreLockedWhereTheyStand) {
  Biped changes;
  const auto link = [](const std::string& name) {
    return "<link name='" + name +
           "'><inertial><origin xyz='0 0 0.1'/><mass value='0.5'/><inertia ixx='0.001' ixy='0' "
           "ixz='0' "
           "iyy='0.001' iyz='0' izz='0.001'/></inertial></link>";
  };
  const auto joint = [](const std::string& name, const char* type, const std::string& child,
                        const std::string& more) {
    return "<joint name='" + name + "' type='" + type + "'><parent link='base'/><child link='" +
           child +
           "'/><origin xyz='0 0 0.3'/><axis xyz='0 1 0'/><limit lower='0.1' upper='0.5' effort='9' "
           "velocity='9'/>" +
           more + "</joint>";
  };
  changes.more_links =
      link("a") + link("b") + link("c") + link("d") + joint("lift", "prismatic", "a", "") +
      joint("claw", "revolute", "b", "") +
      joint("other_claw", "revolute", "c", "<mimic joint='claw' multiplier='-2' offset='0.7'/>") +
      joint("stiff", "fixed", "d", "<mimic joint='claw'/>");
  const std::string text = SimpleBiped(changes);
  const RobotImport imported = ImportText("coupled", text);
  const robot::RobotModel model = robot::MakeRobot(imported.robot, text);
  EXPECT_EQ(model.num_joints(), 12);
  // The nearest to zero within 0.1 to 0.5, and what follows from it.
  EXPECT_TRUE(model.FindFrame("a")->pose.translation().isApprox(Vector3d(0, 0.1, 0.3), 1e-12));
  const auto angle = [&](const char* frame) {
    const Matrix3d r = model.FindFrame(frame)->pose.linear();
    return std::atan2(r(0, 2), r(0, 0));
  };
  EXPECT_NEAR(angle("b"), 0.1, 1e-12);
  EXPECT_NEAR(angle("c"), 0.7 - 2 * 0.1, 1e-12);
  EXPECT_NEAR(angle("d"), 0, 1e-12);
  EXPECT_THAT(Defects(imported), HasSubstr("joint 'other_claw' mimics 'claw' -> locked"));
  EXPECT_THAT(Defects(imported), HasSubstr("joint 'lift' is prismatic -> locked at 0.1"));
}

TEST(Defects, FiveJointsInALegAreRefusedByName) {
  Biped changes;
  changes.ankle_roll = false;
  try {
    ImportText("five", SimpleBiped(changes));
    FAIL();
  } catch (const robot::RobotError& error) {
    EXPECT_THAT(error.what(), HasSubstr("5 joints"));
    EXPECT_THAT(error.what(), HasSubstr("left_knee_joint"));
    EXPECT_THAT(error.what(), HasSubstr("needs six"));
  }
}

TEST(Defects, WhatIsNoRobotsFileIsNamedWithWhatToDo) {
  ImportOptions folder;
  folder.file = WriteMaker("within", SimpleBiped()).parent_path();
  EXPECT_THAT(Refusal(folder), HasSubstr("is a folder: name the robot's file: it has within.urdf"));
  EXPECT_THAT(RefusalOf(" \n"), HasSubstr("is empty"));
  EXPECT_THAT(RefusalOf("name: \"x\""), HasSubstr("is no XML"));
  EXPECT_THAT(RefusalOf("<sdf version='1.6'><model name='x'/></sdf>"),
              HasSubstr("SDF is not read"));
  EXPECT_THAT(RefusalOf("<robot name='x' xmlns:xacro='http://wiki.ros.org/xacro'>\n<link name='a'>"
                        "<xacro:inertia m='1'/></link></robot>"),
              testing::AllOf(HasSubstr("line 2"), HasSubstr("<xacro:inertia>"),
                             HasSubstr("xacro refused.urdf > robot.urdf")));
  EXPECT_THAT(RefusalOf("<mujoco><include file='g1.xml'/><worldbody/></mujoco>"),
              HasSubstr("import that file"));
}

TEST(Defects, ATypoIsFoundByLine) {
  const std::string whole = SimpleBiped();
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    text.replace(text.find(from), from.size(), to);
    return RefusalOf(text);
  };
  const auto line_of = [&](const std::string& what) {
    return "line " +
           std::to_string(
               1 + std::count(whole.begin(),
                              whole.begin() + static_cast<std::ptrdiff_t>(whole.find(what)), '\n'));
  };
  EXPECT_THAT(
      with("<mass value='3'/>", "<mass value='3 kg'/>"),
      testing::AllOf(HasSubstr(line_of("<link name='left_shin'>")), HasSubstr("left_shin")));
  EXPECT_THAT(
      with("<joint name='left_knee_joint' type='revolute'",
           "<joint name='left_knee_joint' type='revolut'"),
      testing::AllOf(HasSubstr(line_of("<joint name='left_knee_joint'")), HasSubstr("revolut")));
  EXPECT_THAT(
      with("<child link='left_shin'/>", "<child link='left_shinn'/>"),
      testing::AllOf(HasSubstr(line_of("<joint name='left_knee_joint'")), HasSubstr("left_shinn")));
}

TEST(Defects, ARobotOnWheelsIsRefusedByItsWheels) {
  std::string text =
      "<robot name='cart'><link name='base'><inertial><mass value='9'/><inertia ixx='1' "
      "ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial></link>";
  for (const auto& [side, y] : {std::pair{"left", 0.2}, std::pair{"right", -0.2}}) {
    const std::string wheel = side + std::string("_wheel");
    text += "<link name='" + wheel +
            "'><inertial><mass value='1'/><inertia ixx='0.01' ixy='0' ixz='0' "
            "iyy='0.01' iyz='0' izz='0.01'/></inertial></link><joint name='" +
            wheel + "_joint' type='continuous'><parent link='base'/><child link='" + wheel +
            "'/><origin xyz='0 " + std::to_string(y) +
            " -0.3'/><axis xyz='0 1 0'/><limit effort='5' velocity='9'/></joint>";
  }
  EXPECT_THAT(RefusalOf(text + "</robot>"),
              testing::AllOf(HasSubstr("_wheel' has 1 joint ("), HasSubstr("needs six")));
}

TEST(Defects, ABaseThatFacesElsewhereIsTheSameRobot) {
  const robot::RobotModel straight =
      robot::MakeRobot(ImportText("straight", SimpleBiped()).robot, SimpleBiped());
  for (const char* rpy : {"0 0 3.141592653589793", "0 0 1.5707963267948966"}) {
    Biped changes;
    changes.base_rpy = rpy;
    const std::string text = SimpleBiped(changes);
    const RobotImport imported = ImportText("turned", text);
    EXPECT_THAT(Defects(imported), HasSubstr("does not face along its x axis")) << rpy;
    const robot::RobotModel model = robot::MakeRobot(imported.robot, text);
    std::mt19937 random(TestSeed(5));
    const robot::RobotState state = robot::RandomState(model, &random);
    const robot::RobotData a = robot::Evaluate(straight, state), b = robot::Evaluate(model, state);
    EXPECT_NEAR((a.mass_matrix - b.mass_matrix).norm(), 0, 1e-8 * a.mass_matrix.norm());
    EXPECT_NEAR((a.bias - b.bias).norm(), 0, 1e-8 * a.bias.norm());
    for (size_t f = 0; f < 2; ++f) {
      EXPECT_TRUE(a.foot_pose[f].isApprox(b.foot_pose[f], 1e-8)) << rpy;
    }
  }
}

TEST(Defects, AFileWithoutMassesIsRefused) {
  const std::string maker =
      std::regex_replace(SimpleBiped(), std::regex("<inertial>[^]*?</inertial>"), "");
  ASSERT_EQ(maker.find("mass"), std::string::npos);
  try {
    ImportText("massless", maker);
    FAIL() << "imported";
  } catch (const robot::RobotError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no link has a mass"));
    EXPECT_THAT(error.what(), HasSubstr("<inertial>"));
  }
}

TEST(Stance, SolesAreLevelAndTheComIsAboveTheirMiddle) {
  const RobotImport imported = ImportText("stance", SimpleBiped());
  const robot::RobotModel model = robot::MakeRobot(imported.robot, SimpleBiped());
  robot::PostureGoal goal;
  goal.nominal = model.stance().joint_position;
  goal.com_height = *model.stance().com_height;
  const double y = *model.stance().foot_spacing / 2;
  EXPECT_NEAR(y, 0.1, 1e-9);
  goal.foot = {Eigen::Isometry3d(Eigen::Translation3d(0, -y, 0)),
               Eigen::Isometry3d(Eigen::Translation3d(0, y, 0))};
  const robot::RobotState state = robot::SolvePosture(model, goal);
  // Forward kinematics of the file itself, written out: hip to sole through thigh and shin.
  const robot::RobotData data = robot::Evaluate(model, state);
  for (size_t f = 0; f < 2; ++f) {
    EXPECT_NEAR(data.foot_pose[f].linear()(2, 2), 1, 1e-9);
    EXPECT_NEAR(data.foot_pose[f].translation().z(), 0, 1e-9);
  }
  EXPECT_NEAR(data.com.head<2>().norm(), 0, 1e-9);
  // Knees bend forward: the COM of legs bent by 0.6 rad, ankle below hip, is 0.7623 m high; moved
  // over the middle of the sole at that height it leaves 0.5707 rad (the masses of the file in the
  // sagittal plane, written out and solved apart). The height is rounded to 0.1 mm: 1e-3 rad.
  EXPECT_NEAR(goal.com_height, 0.7623, 1e-4);
  for (const char* knee : {"left_knee_joint", "right_knee_joint"}) {
    EXPECT_NEAR(state.joint_position[model.FindJoint(knee)], 0.5707, 2e-3);
  }
}

TEST(Stance, TheSrdfBesideTheFileGivesIt) {
  ImportOptions options;
  options.file = WriteMaker("srdf", SimpleBiped());
  std::ofstream(options.file.parent_path() / "any.srdf")
      << "<robot name='biped'><group_state name='half_sitting' group='all'>"
         "<joint name='left_hip_pitch_joint' value='-0.5'/><joint name='left_knee_joint' "
         "value='1'/>"
         "<joint name='left_ankle_pitch_joint' value='-0.5'/>"
         "<joint name='right_hip_pitch_joint' value='-0.5'/><joint name='right_knee_joint' "
         "value='1'/>"
         "<joint name='right_ankle_pitch_joint' value='-0.5'/></group_state></robot>";
  const RobotImport imported = ImportRobot(options);
  for (const JointPosition& joint : imported.robot.stance().joint()) {
    if (joint.joint() != "left_knee_joint") continue;
    EXPECT_NEAR(joint.position(), 1, 0.05);
  }
  options.stance = "sitting_on_the_moon";
  EXPECT_THROW(ImportRobot(options), std::runtime_error);
}

}  // namespace
}  // namespace poise
