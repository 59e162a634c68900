// Makers' files that say less, or something else, than they should: what import takes instead, and
// that it says so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <regex>

#include "components/robot/posture.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "tests/robot/robot_test_support.h"
#include "tests/robot_import/import_support.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), std::string::npos) << from;
  for (size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string Told(const RobotImport& imported) {
  std::string text;
  for (const Defect& defect : imported.defects) text += defect.what + " -> " + defect.done + "\n";
  for (const Finding& f : imported.findings) text += f.what + ": " + f.value + ", " + f.from + "\n";
  return text;
}

std::string Link(const std::string& name, double mass, const std::string& com = "0 0 0") {
  return fmt::format(
      "<link name='{0}'><inertial><origin xyz='{2}'/><mass value='{1}'/><inertia ixx='{3}' ixy='0' "
      "ixz='0' iyy='{3}' iyz='0' izz='{3}'/></inertial></link>",
      name, mass, com, 0.004 * mass);
}

std::string Joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& at, const std::string& axis = "0 1 0",
                  const std::string& more = "") {
  return fmt::format(
      "<joint name='{}' type='revolute'><parent link='{}'/><child link='{}'/><origin xyz='{}'/>"
      "<axis xyz='{}'/><limit lower='-1' upper='1' effort='20' velocity='10'/>{}</joint>",
      name, parent, child, at, axis, more);
}

/// N·m about the right hip's roll axis, of all that it carries, with the COM above the right sole.
double HipMoment(const robot::RobotModel& model) {
  robot::PostureGoal goal = robot::StandingGoal(model);
  goal.com_xy = goal.foot[0].translation().head<2>();
  const robot::RobotState state = robot::SolvePosture(model, goal);
  const robot::RobotData data = robot::Evaluate(model, state);
  const auto hip = static_cast<size_t>(
      model.joints()[static_cast<size_t>(model.FindJoint("right_hip_roll_joint"))].body);
  double moment = 0;
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const robot::Body& body = model.bodies()[b];
    if (body.name.starts_with("right_") && body.name != "right_hip_yaw") continue;
    const Vector3d com = data.body_position[b] + data.body_rotation[b] * body.com;
    moment += body.mass * robot::kGravity * (com.y() - data.body_position[hip].y());
  }
  return std::abs(moment);
}

std::string WithHipRoll(double effort) {
  return std::regex_replace(SimpleBiped(), std::regex("(hip_roll_joint[^\n]*effort=')100"),
                            fmt::format("$01{:.3f}", effort));
}

TEST(OddFiles, AMotorIsRatedForStandingOnOneFoot) {
  const double moment =
      HipMoment(robot::MakeRobot(ImportText("plain", SimpleBiped()).robot, SimpleBiped()));
  // 70 % of the limit is more than half of it, with the reserve of a quarter 87.5 %.
  const RobotImport imported = ImportText("weak_hip", WithHipRoll(moment / 0.7));
  EXPECT_NEAR(MotorOf(imported.robot, "right_hip_roll_joint").rated_current(), 0.875 * 30, 0.6);
  EXPECT_EQ(MotorOf(imported.robot, "right_hip_yaw_joint").rated_current(), 15);
  EXPECT_THAT(Told(imported),
              HasSubstr("rated: half of the peak, or more where one foot takes it"));
  // Beyond its limit it is rated for all that it has, not for more.
  const RobotImport weaker = ImportText("weaker_hip", WithHipRoll(moment / 1.1));
  EXPECT_EQ(MotorOf(weaker.robot, "left_hip_roll_joint").rated_current(), 30);
}

TEST(OddFiles, TheStanceNarrowsUntilOneFootBearsIt) {
  const RobotImport plain = ImportText("plain", SimpleBiped());
  EXPECT_NEAR(plain.robot.stance().foot_spacing(), 0.2, 1e-9);
  const double moment = HipMoment(robot::MakeRobot(plain.robot, SimpleBiped()));
  const double effort = moment / 0.93;
  const std::string text = WithHipRoll(effort);
  const RobotImport narrower = ImportText("narrower", text);
  const double spacing = narrower.robot.stance().foot_spacing();
  EXPECT_LT(spacing, 0.195);
  EXPECT_GE(spacing, 0.14) << "soles of 0.1 m, 0.04 m between them";
  EXPECT_LE(HipMoment(robot::MakeRobot(narrower.robot, text)), 0.9 * effort);
  EXPECT_THAT(Told(narrower), HasSubstr("nearer than 0.200 m, where one foot takes 93 % of"));
}

TEST(OddFiles, PlaceholdersOfLimitsAreNamedAndNothingFollowsFromThem) {
  const std::string text = Replaced(Replaced(SimpleBiped(), "effort='100'", "effort='50000'"),
                                    "velocity='10'", "velocity='120'");
  const RobotImport imported = ImportText("placeholders", text);
  EXPECT_THAT(Told(imported), AllOf(HasSubstr("12 joints have a torque limit in N·m of 50000"),
                                    HasSubstr("12 joints have a velocity limit in rad/s of 120")));
  const robot::RobotModel model = robot::MakeRobot(imported.robot, text);
  for (size_t j = 0; j < model.joints().size(); ++j) {
    // G1's knee has 4.2 N·m for each kg of the robot.
    EXPECT_LT(model.joints()[j].effort, 5 * model.total_mass());
    EXPECT_GT(model.joints()[j].effort, 1 * model.total_mass());
    EXPECT_LT(model.joints()[j].velocity_limit, 40);
    EXPECT_LT(model.motors()[j].coulomb_friction, 0.02 * model.joints()[j].effort);
    EXPECT_LT(model.motors()[j].reflected_inertia, 1);
  }
  EXPECT_LT(model.drive_train().gear_stiffness, 1e5);
  // 1 N·m for legs that carry 41 kg is none either.
  EXPECT_THAT(Told(ImportText("ones", Replaced(SimpleBiped(), "effort='100'", "effort='1'"))),
              HasSubstr("12 joints have a torque limit in N·m of 1,"));
}

constexpr char kBox[] =
    "<collision><origin xyz='0.06 0 -0.07'/><geometry><box size='0.24 0.1 0.02'/></geometry>"
    "</collision>";

TEST(OddFiles, SolesOfTwoKindsBecomeMirrorImagesOfTheBetterFounded) {
  std::string text = SimpleBiped();  // the left foot stands first
  const size_t left = text.find(kBox), right = text.rfind(kBox);
  ASSERT_NE(left, right);
  text.replace(right, sizeof kBox - 1,
               "<visual><origin xyz='0.05 0 -0.07'/><geometry><box size='0.2 0.12 0.02'/>"
               "</geometry></visual>");
  text.replace(left, sizeof kBox - 1, Replaced(kBox, "0.06 0 -0.07", "0.06 0.01 -0.07"));
  const RobotImport imported = ImportText("two_kinds", text);
  EXPECT_THAT(Told(imported), HasSubstr("the soles differ: right 0.2 x 0.12 m of visual shapes, "
                                        "left 0.24 x 0.1 m of collision shapes -> both that of "
                                        "the left foot's collision shapes, mirrored"));
  for (const Foot& foot : imported.robot.foot()) {
    EXPECT_NEAR(foot.length(), 0.24, 1e-9);
    EXPECT_NEAR(foot.width(), 0.1, 1e-9);
    EXPECT_NEAR(foot.sole().x(), 0.06, 1e-9);
    EXPECT_NEAR(foot.sole().y(), foot.name() == "left" ? 0.01 : -0.01, 1e-9);
    EXPECT_NEAR(foot.sole().z(), -0.08, 1e-9);
  }
  // Where both are of one kind, nobody can say which is right.
  std::string uneven = SimpleBiped();
  uneven.replace(uneven.rfind("0.24 0.1 0.02"), 13, "0.20 0.1 0.02");
  EXPECT_THAT(Told(ImportText("uneven", uneven)), HasSubstr("-> kept; --sole LENGTH WIDTH"));
}

TEST(OddFiles, WhyWhatCollidesTellsNoSoleIsTold) {
  const std::string sphere =
      "<collision><origin xyz='0.06 0 -0.07'/><geometry><sphere radius='0.01'/></geometry>"
      "</collision>";
  const std::string seen =
      "<visual><origin xyz='0.06 0 -0.07'/><geometry><box size='0.2 0.1 0.02'/></geometry>"
      "</visual>";
  const std::string reason =
      "the feet's collision shapes touch flat ground in no area, as spheres do -> the soles are "
      "of the ";
  const RobotImport imported = ImportText("round", Replaced(SimpleBiped(), kBox, sphere + seen));
  EXPECT_THAT(Told(imported), HasSubstr(reason + "visual shapes; --sole LENGTH WIDTH says better"));
  EXPECT_NEAR(imported.robot.foot(0).length(), 0.2, 1e-9);
  EXPECT_THAT(Told(ImportText("round_alone", Replaced(SimpleBiped(), kBox, sphere))),
              HasSubstr(reason + "share of the leg's length;"));
  // Four of them, one at each corner, are a sole.
  std::string four;
  for (const char* const place : {"0.1 0.05", "0.1 -0.05", "-0.1 0.05", "-0.1 -0.05"}) {
    four += fmt::format(
        "<collision><origin xyz='{} -0.07'/><geometry><sphere radius='0.01'/></geometry>"
        "</collision>",
        place);
  }
  EXPECT_THAT(Told(ImportText("corners", Replaced(SimpleBiped(), kBox, four))),
              Not(HasSubstr("as spheres do")));
}

TEST(OddFiles, OtherUnitsAreNamed) {
  std::string mm;
  const std::string text = SimpleBiped();
  const std::regex place("(origin xyz|box size)='([^ ]+) ([^ ]+) ([^ ']+)'");
  auto from = text.begin();
  for (std::sregex_iterator m(text.begin(), text.end(), place), end; m != end; ++m) {
    mm.append(from, (*m)[0].first);
    mm += fmt::format("{}='{} {} {}'", (*m)[1].str(), 1e3 * std::stod((*m)[2]),
                      1e3 * std::stod((*m)[3]), 1e3 * std::stod((*m)[4]));
    from = (*m)[0].second;
  }
  mm.append(from, text.end());
  EXPECT_THAT(Told(ImportText("mm", mm)), HasSubstr("the legs are 800 m long: are lengths in mm?"));
  const std::string grams =
      std::regex_replace(std::regex_replace(text, std::regex("mass value='([0-9]+)"), "$&000"),
                         std::regex("(i[xyz][xyz])='0\\.([0-9]+)'"), "$1='1$2'");
  EXPECT_THAT(Told(ImportText("grams", grams)), HasSubstr("are masses in g?"));
}

TEST(OddFiles, AMassThatCannotBeIsThatOfTheMirrorImage) {
  for (const char* wrong : {"-5", "0"}) {
    std::string text =
        Replaced(SimpleBiped(),
                 "<link name='right_shin'><inertial><origin xyz='0 0 "
                 "-0.2'/>",
                 "<link name='right_shin'><inertial><origin xyz='0.01 -0.02 -0.2'/>");
    text.replace(text.find("<mass value='3'/>"), 17, fmt::format("<mass value='{}'/>", wrong));
    const RobotImport imported = ImportText("lame", text);
    EXPECT_THAT(Told(imported),
                HasSubstr(fmt::format("link 'left_shin' has a mass of {} kg, and its "
                                      "mirror image 'right_shin' 3 kg",
                                      wrong)));
    const robot::RobotModel model = robot::MakeRobot(imported.robot, text);
    const auto body = static_cast<size_t>(model.FindFrame("left_shin")->body);
    EXPECT_NEAR(model.bodies()[body].mass, 3, 1e-12);
    EXPECT_TRUE(model.bodies()[body].com.isApprox(Vector3d(0.01, 0.02, -0.2), 1e-9));
    EXPECT_NEAR(model.bodies()[body].inertia(0, 0), kShinInertia[0], 1e-9);
    EXPECT_NEAR(model.total_mass(), 41, 1e-9);
  }
}

TEST(OddFiles, APelvisWithoutMassIsNoBracket) {
  const std::string text = Replaced(
      SimpleBiped(),
      "<mass value='20'/><inertia ixx='0.3' ixy='0' ixz='0' iyy='0.25' iyz='0' izz='0.2'/>",
      "<mass value='0'/><inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/>");
  const RobotImport imported = ImportText("hollow", text);
  EXPECT_THAT(Told(imported), HasSubstr("link 'base' weighs nothing and carries 2 limbs"));
  // The legs' 21 kg are the other 86 %.
  EXPECT_NEAR(robot::MakeRobot(imported.robot, text).total_mass(), 21 / 0.86, 2e-3);
}

/// The biped below a trunk with a waist, and arms whose hands hang lower than the hips.
std::string WithTrunk(const std::string& more = "") {
  std::string text = SimpleBiped();
  text.resize(text.rfind("</robot>"));
  text += Link("trunk", 10, "0 0 0.1") + Joint("waist", "trunk", "base", "0 0 -0.1", "0 0 1");
  for (const auto& [side, y] : {std::pair{"left", 0.3}, std::pair{"right", -0.3}}) {
    const std::string s = side;
    text += Link(s + "_upper_arm", 1.5, "0 0 -0.1") + Link(s + "_forearm", 1, "0 0 -0.1") +
            Link(s + "_hand", 0.5, "0 0 -0.05");
    text += Joint(s + "_shoulder", "trunk", s + "_upper_arm", fmt::format("0 {} 0.3", y)) +
            Joint(s + "_elbow", s + "_upper_arm", s + "_forearm", "0 0 -0.3") +
            Joint(s + "_wrist", s + "_forearm", s + "_hand", "0 0 -0.3", "0 0 1");
  }
  return text + more + "</robot>";
}

TEST(OddFiles, LegsThatPartBelowAWaistAreFoundAndArmsAreNone) {
  const RobotImport imported = ImportText("waist", WithTrunk());
  ASSERT_EQ(imported.robot.foot_size(), 2);
  EXPECT_EQ(imported.robot.foot(0).link(), "right_foot");
  EXPECT_EQ(imported.robot.foot(1).link(), "left_foot");
  EXPECT_THAT(Told(imported),
              AllOf(HasSubstr("right leg: right_hip_yaw_joint, right_hip_roll_joint"),
                    HasSubstr("the legs part below it, at 'base'")));
}

TEST(OddFiles, AHandIsNoSecondFoot) {
  std::string text = WithTrunk();
  // Without its left leg: joint and links are fixed to nothing any more.
  const size_t begin = text.find("<link name='left_hip_yaw'"),
               end = text.find("<link name='right_hip_yaw'");
  text.erase(begin, end - begin);
  EXPECT_THAT(RefusalOf(text), AllOf(HasSubstr("'right_foot'"), HasSubstr("no second foot"),
                                     HasSubstr("--right-foot and --left-foot")));
}

TEST(OddFiles, AStanceOutOfReachSaysWhatWasTakenForFeet) {
  std::string text =
      Replaced(SimpleBiped(), "lower='-0.5' upper='0.5'", "lower='-0.02' upper='0.02'");
  text =
      Replaced(text, "<origin xyz='0.06 0 -0.07'/>", "<origin xyz='0.06 0 -0.07' rpy='0.3 0 0'/>");
  EXPECT_THAT(RefusalOf(text), AllOf(HasSubstr("posture cannot be reached"),
                                     HasSubstr("'right_foot' on the right and 'left_foot'"),
                                     HasSubstr("--right-foot and --left-foot")));
}

TEST(OddFiles, FingersAreLockedWhateverTheyAreCalled) {
  std::string more;
  for (const char* finger : {"medius", "ring_a", "minimus"}) {
    more += Link(std::string(finger) + "_1", 0.03) + Link(std::string(finger) + "_2", 0.02);
    more +=
        Joint(std::string(finger) + "_base", "left_hand", std::string(finger) + "_1", "0 0 -0.1");
    more += Joint(std::string(finger) + "_tip", std::string(finger) + "_1",
                  std::string(finger) + "_2", "0 0 -0.03");
  }
  more += Link("head", 0.2) + Joint("neck", "trunk", "head", "0 0 0.5");
  const std::string text = WithTrunk(more);
  const RobotImport imported = ImportText("hand", text);
  // 12 of the legs, waist, 6 of the arms, the light head's.
  EXPECT_EQ(robot::MakeRobot(imported.robot, text).num_joints(), 20);
  EXPECT_THAT(Told(imported), AllOf(HasSubstr("joint 'medius_tip' moves a finger"),
                                    Not(HasSubstr("joint 'neck' moves"))));
}

TEST(OddFiles, TwoForceSensorsOfAFootAreItsWrenchAndAGsensorIsAnImu) {
  Biped changes;
  for (const char* name : {"right_front_ft_sensor", "right_rear_ft_sensor"}) {
    changes.more_links += fmt::format(
        "<link name='{0}'/><joint name='{0}_joint' type='fixed'><parent link='right_foot'/><child "
        "link='{0}'/></joint><gazebo reference='{0}_joint'><sensor name='{0}' "
        "type='force_torque'/></gazebo>",
        name);
  }
  changes.more_links +=
      "<link name='gsensor'/><joint name='gsensor_joint' type='fixed'><parent link='base'/><child "
      "link='gsensor'/></joint>";
  const RobotImport imported = ImportText("sensors", SimpleBiped(changes));
  EXPECT_THAT(Told(imported),
              HasSubstr("right force sensor: yes, the sum of 2 sensors, at "
                        "right_front_ft_sensor_joint and right_rear_ft_sensor_joint"));
  EXPECT_EQ(imported.robot.imu().link(), "gsensor");
}

TEST(OddFiles, WhatIsNoFileEndsAtOnceAndALfsPointerIsNamed) {
  ImportOptions options;
  options.file = WriteMaker("pipe", "").parent_path() / "pipe";
  ASSERT_EQ(mkfifo(options.file.c_str(), 0600), 0);
  EXPECT_THAT(Refusal(options), HasSubstr("is a pipe or a device"));
  options.file = "/dev/zero";
  EXPECT_THAT(Refusal(options), HasSubstr("is a pipe or a device"));
  EXPECT_THAT(RefusalOf("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n"),
              AllOf(HasSubstr("is a Git LFS pointer"), HasSubstr("git lfs pull")));
  options.file = WriteMaker("large", "<robot>" + std::string(17u << 20, ' ') + "</robot>");
  EXPECT_THAT(Refusal(options), HasSubstr("the file has 17825807 bytes, more than 16777216"));
}

TEST(OddFiles, MoreJointsThanThereIsRoomForAreRefused) {
  std::string text = "<robot name='snakes'>" + Link("base", 10);
  for (const auto& [side, y] : {std::pair{"left", 0.1}, std::pair{"right", -0.1}}) {
    std::string parent = "base";
    for (int i = 0; i < 100; ++i) {
      const std::string link = fmt::format("{}_{}", side, i);
      text += Link(link, 0.1) +
              Joint(link + "_joint", parent, link, fmt::format("0 {} -0.01", i == 0 ? y : 0.0));
      parent = link;
    }
  }
  EXPECT_THAT(RefusalOf(text + "</robot>"), AllOf(HasSubstr("200 joints move"), HasSubstr("128")));
}

TEST(OddFiles, WhyALegLacksAJointIsTold) {
  const std::string text = SimpleBiped();
  const std::string at = "<joint name='left_ankle_roll_joint'";
  std::string coupled = text;
  coupled.insert(coupled.find("</joint>", coupled.find(at)), "<mimic joint='left_knee_joint'/>");
  EXPECT_THAT(RefusalOf(coupled),
              AllOf(HasSubstr("5 joints"), HasSubstr("joint 'left_ankle_roll_joint' mimics "
                                                     "'left_knee_joint'")));
  // The joint that is followed is no finger's for that.
  coupled = text;
  coupled.insert(coupled.find("</joint>", coupled.find(at)),
                 "<mimic joint='left_ankle_pitch_joint'/>");
  EXPECT_THAT(RefusalOf(coupled),
              AllOf(HasSubstr("'left_ankle_roll_joint' mimics"), Not(HasSubstr("moves a finger"))));
  std::string mjcf =
      robot::ReadWhole(std::filesystem::path(POISE_SOURCE_DIR) / "deploy/robots/heron/heron.xml");
  mjcf = std::regex_replace(mjcf, std::regex("<motor[^>]*joint=\"right_ankle_roll[^>]*/>"), "");
  mjcf.insert(mjcf.find("</mujoco>"), "<tendon><fixed name=\"t\"/></tendon>");
  EXPECT_THAT(RefusalOf(mjcf), AllOf(HasSubstr("5 joints"), HasSubstr("has no actuator of its own"),
                                     HasSubstr("<tendon> moves is left out")));
}

TEST(OddFiles, AnMjcfBaseWithoutAFreeJointFloats) {
  const std::string text =
      robot::ReadWhole(std::filesystem::path(POISE_SOURCE_DIR) / "deploy/robots/heron/heron.xml");
  const std::regex free("<freejoint[^>]*/>");
  ASSERT_TRUE(std::regex_search(text, free));
  const RobotImport plain = ImportText("free", text);
  const std::string slides =
      "<joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/>"
      "<joint type=\"slide\" axis=\"0 0 1\"/><joint type=\"ball\"/>";
  for (const std::string& base : {slides, std::string()}) {
    const RobotImport imported = ImportText("base", std::regex_replace(text, free, base));
    EXPECT_EQ(imported.robot.motor_size(), plain.robot.motor_size());
    EXPECT_EQ(imported.robot.stance().SerializeAsString(),
              plain.robot.stance().SerializeAsString());
  }
  // One hinge to the world is no floating base.
  EXPECT_THAT(RefusalOf(std::regex_replace(text, free, "<joint name=\"pole\" axis=\"0 0 1\"/>")),
              HasSubstr("'pole' holds the root body"));
}

}  // namespace
}  // namespace poise
