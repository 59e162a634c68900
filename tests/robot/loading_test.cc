// What is read from a URDF and a Robot file: order, merging, frames, motors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "components/framework/configuration/configuration.h"
#include "components/robot_files/robot_files.h"
#include "tests/robot/robot_test_support.h"
#include "tests/test_seed.h"

namespace poise::robot {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::vector<std::string> JointNames(const RobotModel& model) {
  std::vector<std::string> names;
  for (const Joint& joint : model.joints()) names.push_back(joint.name);
  return names;
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Loading, DyrosIsThePapersRobot) {
  const RobotModel model = LoadTestRobot(TestRobot::kDyros);
  EXPECT_EQ(model.name(), "dyros_legs");
  EXPECT_EQ(model.num_joints(), 12);
  EXPECT_NEAR(model.total_mass(), 54.63, 1e-9);
  ASSERT_EQ(model.feet().size(), 2u);
  EXPECT_EQ(model.feet()[Foot::kRight].name, "right");
  for (const FootModel& foot : model.feet()) {
    EXPECT_EQ(foot.length, 0.30);
    EXPECT_EQ(foot.width, 0.15);
  }
  EXPECT_THAT(JointNames(model),
              testing::ElementsAre("right_hip_yaw", "right_hip_roll", "right_hip_pitch",
                                   "right_knee_pitch", "right_ankle_pitch", "right_ankle_roll",
                                   "left_hip_yaw", "left_hip_roll", "left_hip_pitch",
                                   "left_knee_pitch", "left_ankle_pitch", "left_ankle_roll"));
  const MotorModel& motor = model.motors()[model.FindJoint("left_knee_pitch") * 1u];
  EXPECT_NEAR(motor.reflected_inertia, 0.10, 1e-12);
  EXPECT_NEAR(motor.torque_per_ampere() * motor.rated_current, 75, 1e-12);
  EXPECT_EQ(motor.coulomb_friction, 2);
  EXPECT_EQ(motor.static_friction, 2.4);
  EXPECT_EQ(model.FindJoint("no_such_joint"), -1);
  // Standing straight, all joints at zero: the soles lie 0.72 + 0.105 + 0.10 m below the base.
  const RobotData data = Evaluate(model, RobotState(12));
  EXPECT_NEAR((data.foot_pose[Foot::kRight].translation() - Vector3d(0.03, -0.105, -0.925)).norm(),
              0, 1e-12);
  EXPECT_NEAR((data.foot_pose[Foot::kLeft].translation() - Vector3d(0.03, 0.105, -0.925)).norm(), 0,
              1e-12);
}

TEST(Loading, StanceAndDriveTrainAreTheFiles) {
  const RobotModel model = LoadTestRobot(TestRobot::kDyros);
  EXPECT_EQ(model.stance().com_height, 0.75);
  EXPECT_FALSE(model.stance().foot_spacing);
  EXPECT_EQ(model.stance().joint_position[model.FindJoint("left_knee_pitch")], 0.6);
  EXPECT_EQ(model.stance().joint_position[model.FindJoint("left_hip_yaw")], 0);
  EXPECT_EQ(model.drive_train().gear_stiffness, 7e4);
  EXPECT_EQ(model.drive_train().sensor_delay, 0.002);
  const RobotModel without = LoadTestRobot(TestRobot::kMantis);
  EXPECT_TRUE(without.stance().joint_position.isZero(0));
  EXPECT_EQ(without.stance().joint_position.size(), without.num_joints());
  EXPECT_EQ(without.drive_train().gear_stiffness, 0);
}

TEST(Loading, StaticFrictionIsCoulombsWhenNotGiven) {
  std::string text = ReadWhole(RobotPath(TestRobot::kDyros));
  text.erase(text.find("static_friction: 2.4"), std::string("static_friction: 2.4").size());
  const RobotModel model = LoadRobotTexts(text, ReadWhole(UrdfPath(TestRobot::kDyros)));
  for (const MotorModel& motor : model.motors()) {
    EXPECT_EQ(motor.static_friction, motor.coulomb_friction);
  }
}

TEST(Loading, JointsAreInDepthFirstOrderOfTheText) {
  // Neither sorted by name nor in the order of declaration: the legs stand before the waist, the
  // right arm before the left one.
  const RobotModel model = LoadTestRobot(TestRobot::kMantis);
  EXPECT_THAT(JointNames(model),
              testing::ElementsAre("left_hip_pitch", "left_hip_roll", "left_hip_yaw", "left_knee",
                                   "left_ankle_pitch", "left_ankle_roll", "right_hip_pitch",
                                   "right_hip_roll", "right_hip_yaw", "right_knee",
                                   "right_ankle_pitch", "right_ankle_roll", "waist_yaw",
                                   "right_shoulder_pitch", "right_shoulder_roll", "right_elbow",
                                   "left_shoulder_pitch", "left_shoulder_roll", "left_elbow"));
  for (size_t b = 1; b < model.bodies().size(); ++b) {
    EXPECT_LT(model.bodies()[b].parent, static_cast<int>(b));
    EXPECT_EQ(model.bodies()[b].joint, static_cast<int>(b) - 1);
    EXPECT_EQ(model.joints()[b - 1].body, static_cast<int>(b));
  }
}

TEST(Loading, OrderOfLegsInTheTextChangesIndicesOnly) {
  const std::string urdf = ReadWhole(UrdfPath(TestRobot::kDyros));
  const std::string robot = ReadWhole(RobotPath(TestRobot::kDyros));
  const size_t right = urdf.find("  <joint name=\"right_hip_yaw\"");
  const size_t left = urdf.find("  <joint name=\"left_hip_yaw\"");
  const size_t end = urdf.find("</robot>");
  const std::string swapped = urdf.substr(0, right) + urdf.substr(left, end - left) +
                              urdf.substr(right, left - right) + urdf.substr(end);
  const RobotModel a = LoadRobotTexts(robot, urdf);
  const RobotModel b = LoadRobotTexts(robot, swapped);
  EXPECT_EQ(b.joints()[0].name, "left_hip_yaw");
  std::mt19937 random(TestSeed(5));
  const RobotState state = RandomState(a, &random);
  RobotState other = state;
  for (int j = 0; j < 12; ++j) {
    const int k = b.FindJoint(a.joints()[static_cast<size_t>(j)].name);
    other.joint_position[k] = state.joint_position[j];
    other.joint_velocity[k] = state.joint_velocity[j];
  }
  const RobotData da = Evaluate(a, state), db = Evaluate(b, other);
  EXPECT_LT((da.com - db.com).norm(), 1e-12);
  EXPECT_LT((da.foot_pose[0].matrix() - db.foot_pose[0].matrix()).norm(), 1e-12);
  EXPECT_LT((da.mass_matrix.topLeftCorner<6, 6>() - db.mass_matrix.topLeftCorner<6, 6>()).norm(),
            1e-10);
}

TEST(Loading, FixedLinksMergeToTheCompositeByHand) {
  // A pack as heavy as the upper body, 1 m above it, turned by 90 degrees about z: its x and y
  // moments change places.
  const std::string urdf = Replaced(
      ReadWhole(UrdfPath(TestRobot::kDyros)), "</robot>",
      "<link name=\"pack\"><inertial><origin xyz=\"0.5 0 0\" rpy=\"0 0 1.5707963267948966\"/>"
      "<mass value=\"22.63\"/><inertia ixx=\"3\" ixy=\"0\" ixz=\"0\" iyy=\"2\" iyz=\"0\" "
      "izz=\"2.5\"/></inertial></link>"
      "<joint name=\"mount\" type=\"fixed\"><origin xyz=\"0.5 0 1.19\" rpy=\"0 0 "
      "3.141592653589793\"/><parent link=\"upper_body\"/><child link=\"pack\"/></joint></robot>");
  const RobotModel model = LoadRobotTexts(ReadWhole(RobotPath(TestRobot::kDyros)), urdf);
  const Body& base = model.bodies()[0];
  EXPECT_EQ(base.name, "upper_body");
  EXPECT_NEAR(base.mass, 45.26, 1e-12);
  EXPECT_LT((base.com - Vector3d(0, 0, 0.69)).norm(), 1e-12);
  // Parallel axes: both centres lie 0.5 m from the common one, along z.
  const double shift = 45.26 * 0.25;
  const Vector3d expected(0.8788 + 2 + shift, 0.7430 + 3 + shift, 0.3530 + 2.5);
  EXPECT_LT((base.inertia - Matrix3d(expected.asDiagonal())).norm(), 1e-9);
}

TEST(Loading, ImuAndBodyFramesThroughFixedLinks) {
  const RobotModel model = LoadTestRobot(TestRobot::kMantis);
  const size_t torso = static_cast<size_t>(model.body_task_body());
  EXPECT_EQ(model.bodies()[torso].name, "torso");
  EXPECT_EQ(model.imu().body, model.body_task_body());
  // torso -> stalk -> camera -> optical frame -> IMU, with the numbers of the files.
  const auto pose = [](double x, double y, double z, double roll, double pitch, double yaw) {
    Eigen::Isometry3d p = Eigen::Isometry3d::Identity();
    p.translate(Vector3d(x, y, z));
    p.rotate(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
    p.rotate(Eigen::AngleAxisd(pitch, Vector3d::UnitY()));
    p.rotate(Eigen::AngleAxisd(roll, Vector3d::UnitX()));
    return p;
  };
  const Eigen::Isometry3d expected =
      pose(0.05, 0, 0.36, 0, 0.4, 0) * pose(0.02, 0, 0.1, -0.2, 0.3, 1.2) *
      pose(0, 0, 0, -M_PI / 2, 0, -M_PI / 2) * pose(0.01, 0.02, 0.03, 0.1, 0.2, 0.3);
  EXPECT_LT((model.imu().pose.matrix() - expected.matrix()).norm(), 1e-12);
}

TEST(Loading, AxesAreUnitAndContinuousJointsUnbounded) {
  const RobotModel model = LoadTestRobot(TestRobot::kMantis);
  const Joint& waist = model.joints()[model.FindJoint("waist_yaw") * 1u];
  EXPECT_LT((waist.axis - Vector3d(0, 0, -1)).norm(), 1e-15);  // written 0 0 -2
  const Joint& elbow = model.joints()[model.FindJoint("right_elbow") * 1u];
  EXPECT_TRUE(std::isinf(elbow.lower) && elbow.lower < 0);
  EXPECT_TRUE(std::isinf(elbow.upper) && elbow.upper > 0);
  EXPECT_EQ(elbow.effort, 30);
}

TEST(Loading, BodyLinkDefaultsToTheRoot) {
  const RobotModel model =
      LoadRobotTexts(Replaced(ReadWhole(RobotPath(TestRobot::kMantis)), "body_link: \"torso\"", ""),
                     ReadWhole(UrdfPath(TestRobot::kMantis)));
  EXPECT_EQ(model.body_task_body(), 0);
  EXPECT_EQ(model.bodies()[0].name, "root");
}

TEST(Loading, SupportingJointsLeadToTheBase) {
  const RobotModel model = LoadTestRobot(TestRobot::kMantis);
  EXPECT_TRUE(model.supporting_joints(0).empty());
  std::vector<std::string> names;
  for (const int j : model.supporting_joints(model.feet()[Foot::kRight].body)) {
    names.push_back(model.joints()[static_cast<size_t>(j)].name);
  }
  EXPECT_THAT(names, testing::ElementsAre("right_ankle_roll", "right_ankle_pitch", "right_knee",
                                          "right_hip_yaw", "right_hip_roll", "right_hip_pitch"));
}

TEST(Loading, PrintsNothing) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  EXPECT_THROW(LoadRobotTexts(ReadWhole(RobotPath(TestRobot::kDyros)),
                              Replaced(ReadWhole(UrdfPath(TestRobot::kDyros)),
                                       "<mass value=\"22.63\"/>", "<mass value=\"heavy\"/>")),
               RobotError);
  LoadTestRobot(TestRobot::kMantis);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace poise::robot
