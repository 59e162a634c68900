// Every refusal: one line that names the culprit and the remedy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "tests/robot/robot_test_support.h"

namespace poise::robot {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct Case {
  const char* name;
  enum File { kUrdf, kRobot } file;
  const char *from, *to;                // the first `from` becomes `to`
  std::array<const char*, 5> expected;  // parts of the message
};

constexpr Case::File kUrdf = Case::kUrdf, kRobot = Case::kRobot;

#define RIGHT_KNEE "<joint name=\"right_knee_pitch\" type=\""
#define KNEE_LIMIT "<limit lower=\"0\" upper=\"2.2\" effort=\"150\" velocity=\"9\"/>"
#define FOOT_MASS                                                                              \
  "<mass value=\"1.5\"/>\n      <inertia ixx=\"0.00313\" ixy=\"0\" ixz=\"0\" iyy=\"0.01156\" " \
  "iyz=\"0\" izz=\"0.01406\"/>"

constexpr Case kCases[] = {
    // XML
    {"Empty", kUrdf, "", "@empty", {"not XML"}},
    {"NotXml", kUrdf, "<link name=\"imu\"/>", "<link name=<>", {"line ", "not XML"}},
    {"Unclosed", kUrdf, "</robot>", "", {"not XML"}},
    {"NoRobotElement", kUrdf, "", "@<sdf/>", {"no <robot> element"}},
    {"NoLinks", kUrdf, "", "@<robot name=\"a\"/>", {"no <link>"}},
    {"NulByte", kUrdf, "<robot", "@nul", {"NUL byte"}},
    {"TooDeep", kUrdf, "<robot", "@deep", {"nests elements"}},
    {"NoRobotName", kUrdf, "<robot name=\"dyros_legs\">", "<robot>", {"name"}},
    {"FormatString",
     kUrdf,
     "<mass value=\"22.63\"/>",
     "<mass value=\"%n%n%n\"/>",
     {"line ", "value '%n%n%n'", "remove it"}},
    // structure
    {"LinkTwice",
     kUrdf,
     "<link name=\"imu\"/>",
     "<link name=\"imu\"/><link name=\"imu\"/>",
     {"link 'imu'", "already"}},
    {"LinkWithoutName", kUrdf, "<link name=\"imu\"/>", "<link/>", {"a link has no name"}},
    {"JointTwice",
     kUrdf,
     "<joint name=\"left_knee_pitch\"",
     "<joint name=\"right_knee_pitch\"",
     {"joint 'right_knee_pitch'", "already"}},
    {"JointWithoutChild",
     kUrdf,
     "<child link=\"right_shank\"/>",
     "",
     {"joint 'right_knee_pitch'", "no child"}},
    {"UnknownParent",
     kUrdf,
     "<parent link=\"right_thigh\"/>",
     "<parent link=\"femur\"/>",
     {"joint 'right_knee_pitch'", "'femur'", "does not exist"}},
    {"UnknownChild",
     kUrdf,
     "<child link=\"right_shank\"/>",
     "<child link=\"tibia\"/>",
     {"joint 'right_knee_pitch'", "'tibia'", "does not exist"}},
    {"TwoParents",
     kUrdf,
     "</robot>",
     "<joint name=\"bar\" type=\"fixed\"><parent link=\"left_foot\"/><child "
     "link=\"right_foot\"/></joint></robot>",
     {"link 'right_foot'", "two parents", "'right_ankle_roll'", "'bar'", "closed loops"}},
    {"Loop",
     kUrdf,
     "<parent link=\"upper_body\"/>\n    <child link=\"right_hip_yaw_link\"/>",
     "<parent link=\"right_foot\"/><child link=\"right_hip_yaw_link\"/>",
     {"closed loop", "remove one joint"}},
    {"LoopThroughRoot",
     kUrdf,
     "</robot>",
     "<joint name=\"bar\" type=\"fixed\"><parent link=\"left_foot\"/><child "
     "link=\"upper_body\"/></joint></robot>",
     {"closed loop"}},
    {"Unconnected",
     kUrdf,
     "</robot>",
     "<link name=\"crate\"/></robot>",
     {"'crate'", "'upper_body'", "not connected"}},
    // joints
    {"Prismatic",
     kUrdf,
     RIGHT_KNEE "revolute\">",
     "<joint name=\"right_knee_pitch\" type=\"prismatic\">",
     {"joint 'right_knee_pitch' is prismatic", "fixed"}},
    {"Planar",
     kUrdf,
     RIGHT_KNEE "revolute\">",
     "<joint name=\"right_knee_pitch\" type=\"planar\">",
     {"joint 'right_knee_pitch' is planar"}},
    {"Floating",
     kUrdf,
     RIGHT_KNEE "revolute\">",
     "<joint name=\"right_knee_pitch\" type=\"floating\">",
     {"joint 'right_knee_pitch' is floating", "the root link floats already"}},
    {"UnknownType",
     kUrdf,
     RIGHT_KNEE "revolute\">",
     "<joint name=\"right_knee_pitch\" type=\"ball\">",
     {"right_knee_pitch", "ball"}},
    {"Mimic",
     kUrdf,
     KNEE_LIMIT,
     KNEE_LIMIT "<mimic joint=\"left_knee_pitch\"/>",
     {"joint 'right_knee_pitch' mimics joint 'left_knee_pitch'"}},
    {"ZeroAxis",
     kUrdf,
     "<axis xyz=\"0 1 0\"/>",
     "<axis xyz=\"0 0 0\"/>",
     {"joint 'right_hip_pitch'", "axis", "xyz="}},
    {"AxisOfTwo", kUrdf, "<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 1\"/>", {"right_hip_pitch"}},
    {"NoLimits", kUrdf, KNEE_LIMIT, "", {"right_knee_pitch", "limits"}},
    {"LimitsWithoutEffort",
     kUrdf,
     KNEE_LIMIT,
     "<limit lower=\"0\" upper=\"2.2\" velocity=\"9\"/>",
     {"effort"}},
    {"ZeroEffort",
     kUrdf,
     KNEE_LIMIT,
     "<limit lower=\"0\" upper=\"2.2\" effort=\"0\" velocity=\"9\"/>",
     {"joint 'right_knee_pitch'", "effort limit 0"}},
    {"NegativeVelocity",
     kUrdf,
     KNEE_LIMIT,
     "<limit lower=\"0\" upper=\"2.2\" effort=\"150\" velocity=\"-1\"/>",
     {"joint 'right_knee_pitch'", "velocity limit -1"}},
    {"LimitsReversed",
     kUrdf,
     KNEE_LIMIT,
     "<limit lower=\"2.2\" upper=\"0\" effort=\"150\" velocity=\"9\"/>",
     {"joint 'right_knee_pitch'", "lower must be below upper"}},
    {"ContinuousWithoutLimits",
     kUrdf,
     RIGHT_KNEE "revolute\">",
     "@continuous",
     {"joint 'right_knee_pitch'", "no limits", "effort"}},
    {"NanOrigin",
     kUrdf,
     "<origin xyz=\"0 0 -0.36\"/>",
     "<origin xyz=\"0 0 nan\"/>",
     {"right_knee_pitch"}},
    {"FarOrigin",
     kUrdf,
     "<origin xyz=\"0 0 -0.36\"/>",
     "<origin xyz=\"0 0 1e300\"/>",
     {"joint 'right_knee_pitch'", "origin"}},
    // inertia
    {"NoMass",
     kUrdf,
     FOOT_MASS,
     "<mass value=\"0\"/><inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/>",
     {"link 'right_foot'", "joint 'right_ankle_roll'", "mass is 0 kg"}},
    {"NegativeMass",
     kUrdf,
     "<mass value=\"22.63\"/>",
     "<mass value=\"-22.63\"/>",
     {"link 'upper_body'", "negative"}},
    {"MassNotANumber", kUrdf, "<mass value=\"22.63\"/>", "<mass value=\"nan\"/>", {"upper_body"}},
    {"HugeMass", kUrdf, "<mass value=\"22.63\"/>", "<mass value=\"1e999\"/>", {"upper_body"}},
    {"MassInWrongUnit",
     kUrdf,
     "<mass value=\"22.63\"/>",
     "<mass value=\"1.7e308\"/>",
     {"link 'upper_body'", "1e+06"}},
    {"NegativeInertia",
     kUrdf,
     "ixx=\"0.8788\"",
     "ixx=\"-0.8788\"",
     {"link 'upper_body'", "not positive"}},
    {"Triangle",
     kUrdf,
     "izz=\"0.01406\"",
     "izz=\"0.1\"",
     {"link 'right_foot'", "triangle inequality", "0.00313 + 0.01156 < 0.1"}},
    {"OffDiagonal", kUrdf, "ixy=\"0\"", "ixy=\"2\"", {"link 'upper_body'", "not positive"}},
    {"PointMass",
     kUrdf,
     FOOT_MASS,
     "<mass value=\"1.5\"/><inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" "
     "izz=\"0\"/>",
     {"link 'right_foot'", "not positive definite"}},
    {"InertiaMissing", kUrdf, FOOT_MASS, "<mass value=\"1.5\"/>", {"right_foot"}},
    // robot file
    {"UnknownField", kRobot, "body_link:", "torso_link:", {"torso_link"}},
    {"UnknownImuLink", kRobot, "link: \"imu\"", "link: \"gyro\"", {"imu.link", "no link 'gyro'"}},
    {"NoImu", kRobot, "link: \"imu\"", "", {"imu.link is missing"}},
    {"UnknownFootLink",
     kRobot,
     "link: \"left_foot\"",
     "link: \"left_toe\"",
     {"foot[1].link", "no link 'left_toe'"}},
    {"UnknownBodyLink",
     kRobot,
     "body_link: \"upper_body\"",
     "body_link: \"chest\"",
     {"body_link", "no link 'chest'"}},
    {"ThreeFeet",
     kRobot,
     "imu {",
     "foot { name: \"tail\" link: \"upper_body\" } imu {",
     {"foot: 3 given", "exactly two"}},
    {"FootWithoutName", kRobot, "name: \"left\"", "", {"foot[1].name"}},
    {"FeetOfOneName", kRobot, "name: \"left\"", "name: \"right\"", {"both are named 'right'"}},
    {"FeetOfOneLeg",
     kRobot,
     "link: \"left_foot\"",
     "link: \"right_foot\"",
     {"'right' and 'left'", "one rigid body"}},
    {"LeftFirst", kRobot, "", "@swap", {"right foot", "first"}},
    {"SoleLength", kRobot, "length: 0.30", "length: 0", {"foot[0].length: is 0", "greater than 0"}},
    {"SoleWidth", kRobot, "width: 0.15", "width: -1", {"foot[0].width: is -1"}},
    {"SoleMissing", kRobot, "width: 0.15", "", {"foot[0].width: is missing"}},
    {"SoleBothWays",
     kRobot,
     "width: 0.15",
     "width: 0.15 vertex { x: 1 }",
     {"foot[0]", "remove one"}},
    {"SoleClockwise",
     kRobot,
     "length: 0.30\n  width: 0.15",
     "vertex { x: 0.1 y: 0.1 } vertex { x: 0.1 y: -0.1 } vertex { x: -0.1 y: -0.1 }",
     {"foot[0].vertex", "clockwise", "anticlockwise"}},
    {"SoleDented",
     kRobot,
     "length: 0.30\n  width: 0.15",
     "vertex { x: -0.1 y: -0.1 } vertex { x: 0 y: -0.05 } vertex { x: 0.1 y: -0.1 } "
     "vertex { y: 0.1 }",
     {"foot[0].vertex[1]", "(0, -0.05)", "convex"}},
    {"SolePoseNan", kRobot, "sole { x: 0.03", "sole { x: nan", {"foot[0].sole.x: is nan"}},
    {"FiveJoints",
     kRobot,
     "link: \"right_foot\"",
     "link: \"right_ankle\"",
     {"foot[0] 'right'", "only 5 joints", "'right_ankle'",
      "cannot make a six-dimensional contact"}},
    // motors
    {"JointWithoutMotor",
     kRobot,
     "  joint: \"left_knee_pitch\"\n",
     "",
     {"joint 'left_knee_pitch'", "no motor"}},
    {"MotorOfUnknownJoint",
     kRobot,
     "joint: \"left_knee_pitch\"",
     "joint: \"left_knee\"",
     {"motor[0]", "no joint 'left_knee'"}},
    {"MotorOfFixedJoint",
     kRobot,
     "joint: \"left_knee_pitch\"",
     "joint: \"imu_mount\"",
     {"motor[0]", "joint 'imu_mount' is fixed"}},
    {"TwoMotorsOfOneJoint",
     kRobot,
     "joint: \"left_knee_pitch\"",
     "joint: \"left_knee_pitch\" joint: \"left_knee_pitch\"",
     {"joint 'left_knee_pitch' already has motor[0]"}},
    {"MotorWithoutJoint",
     kRobot,
     "motor {",
     "motor { gear_ratio: 2 } motor {",
     {"motor[0] names no joint"}},
    {"GearRatio", kRobot, "gear_ratio: 50", "gear_ratio: 0", {"motor[0].gear_ratio: is 0"}},
    {"TorqueConstant",
     kRobot,
     "torque_constant: 0.10",
     "",
     {"motor[0].torque_constant: is missing", "greater than 0"}},
    {"RatedCurrent",
     kRobot,
     "rated_current: 15",
     "rated_current: -15",
     {"motor[0].rated_current: is -15"}},
    {"PeakCurrent",
     kRobot,
     "peak_current: 30",
     "peak_current: inf",
     {"motor[0].peak_current: is inf"}},
    {"PeakBelowRated",
     kRobot,
     "peak_current: 30",
     "peak_current: 3",
     {"motor[0].peak_current 3 A is below rated_current 15 A"}},
    {"RotorInertia",
     kRobot,
     "rotor_inertia: 4e-5",
     "rotor_inertia: -4e-5",
     {"motor[0].rotor_inertia"}},
    {"EncoderCounts", kRobot, "encoder_counts: 8192", "", {"motor[0].encoder_counts: is missing"}},
    {"Friction",
     kRobot,
     "coulomb_friction: 2",
     "coulomb_friction: nan",
     {"motor[0].coulomb_friction"}},
    {"StaticFriction",
     kRobot,
     "static_friction: 2.4",
     "static_friction: 1",
     {"motor[0].static_friction 1 N m is below"}},
    {"Stribeck",
     kRobot,
     "coulomb_friction: 2",
     "coulomb_friction: 2 stribeck_velocity: 0",
     {"motor[0].stribeck_velocity: is 0"}},
    {"ImuNoise", kRobot, "gyro_noise: 2e-4", "gyro_noise: -1", {"imu.gyro_noise: is -1"}},
    {"ForceNoise", kRobot, "force_noise: 1.0", "force_noise: -1", {"force_noise: is -1"}},
};

void Replace(std::string* text, const std::string& from, const std::string& to) {
  const size_t at = text->find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text->replace(at, from.size(), to);
}

void Edit(const Case& edit, std::string* text) {
  const std::string to = edit.to;
  if (to == "@empty") {
    text->clear();
  } else if (to == "@nul") {
    text->insert(text->find("<robot"), 1, '\0');
  } else if (to == "@deep") {
    std::string nest;
    for (int i = 0; i < 1000000; ++i) nest += "<a>";
    text->insert(text->find("</robot>"), nest);
  } else if (to == "@continuous") {
    Replace(text, edit.from, "<joint name=\"right_knee_pitch\" type=\"continuous\">");
    Replace(text, KNEE_LIMIT, "");
  } else if (to == "@swap") {
    Replace(text, "link: \"right_foot\"", "link: \"x\"");
    Replace(text, "link: \"left_foot\"", "link: \"right_foot\"");
    Replace(text, "link: \"x\"", "link: \"left_foot\"");
  } else if (to.starts_with("@")) {
    *text = to.substr(1);
  } else {
    Replace(text, edit.from, to);
  }
}

class RefusalTest : public testing::TestWithParam<Case> {};

TEST_P(RefusalTest, IsOneLineNamingCulpritAndRemedy) {
  std::string urdf = ReadWhole(UrdfPath(TestRobot::kDyros));
  std::string robot = ReadWhole(RobotPath(TestRobot::kDyros));
  Edit(GetParam(), GetParam().file == Case::kUrdf ? &urdf : &robot);
  try {
    LoadRobotTexts(robot, urdf);
    ADD_FAILURE() << "accepted";
  } catch (const RobotError& error) {
    const std::string message = error.what();
    for (const char* part : GetParam().expected) {
      if (part) {
        EXPECT_THAT(message, HasSubstr(part));
      }
    }
    EXPECT_THAT(message, Not(HasSubstr("\n")));
    EXPECT_THAT(message, HasSubstr(":"));
    EXPECT_LT(message.size(), 500u);
    RecordProperty("message", message);
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, RefusalTest, testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

std::string FileRefusal(const std::string& path) {
  try {
    LoadRobotFiles(path);
  } catch (const RobotError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(RefusalOfFiles, BeginWithTheFileAtFault) {
  EXPECT_THAT(FileRefusal("nowhere/robot.pbtxt"), HasSubstr("nowhere/robot.pbtxt: cannot be read"));

  const std::string folder = testing::TempDir() + "poise_refusal_" + std::to_string(getpid()) + "/";
  std::filesystem::create_directories(folder);
  const std::string path = folder + "robot.pbtxt";
  std::string robot = ReadWhole(RobotPath(TestRobot::kDyros));
  std::ofstream(path) << robot;
  // At fault is the text: it names a file that is not there.
  EXPECT_THAT(FileRefusal(path), testing::StartsWith(path +
                                                     ": the maker's file 'dyros_legs.urdf' "
                                                     "is not there: put it at " +
                                                     folder + "dyros_legs.urdf"));

  std::string urdf = ReadWhole(UrdfPath(TestRobot::kDyros));
  std::ofstream(folder + "dyros_legs.urdf") << urdf;
  EXPECT_EQ(FileRefusal(path), "accepted");
  Replace(&urdf, "22.63", "-22.63");
  std::ofstream(folder + "dyros_legs.urdf") << urdf;
  EXPECT_THAT(FileRefusal(path), HasSubstr(folder + "dyros_legs.urdf: URDF: link 'upper_body'"));

  Replace(&robot, "length: 0.30", "length: wide");
  std::ofstream(path) << robot;
  EXPECT_THAT(FileRefusal(path), testing::ContainsRegex("robot\\.pbtxt:[0-9]+:[0-9]+: "));
  std::ofstream(path) << "name: \"a\"";
  EXPECT_THAT(FileRefusal(path), HasSubstr("robot.pbtxt: urdf is missing"));
  std::filesystem::remove_all(folder);
}

TEST(RefusalOfModelError, NamesWhatIsWrong) {
  const RobotModel model = LoadTestRobot(TestRobot::kDyros);
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  EXPECT_THROW(model.WithModelError("imu", 1, none), RobotError);  // merged: moves with upper_body
  EXPECT_THROW(model.WithModelError("upper_body", 0, none), RobotError);
  EXPECT_THROW(model.WithModelError("upper_body", 1, none * (0.0 / 0.0)), RobotError);
}

}  // namespace
}  // namespace poise::robot
