#include "logging/element_names.h"

#include <gtest/gtest.h>

#include "components/framework/configuration/configuration.h"
#include "tests/logging/log_test_support.h"

namespace poise::logging {
namespace {

std::string RobotFile(const std::string& name) {
  return ReadFile(POISE_SOURCE_DIR "/deploy/robots/dyros/" + name);
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

TEST(ElementNames, CallsElementsOfEachCountByTheRobot) {
  const ElementNames names = ElementNames::OfSpec(MakeTestSpec());
  EXPECT_EQ(names.Label("joint_command_t", "torque[3]"), "torque[right_knee_pitch]");
  EXPECT_EQ(names.Label("drive_command_t", "current[0]"), "current[right_hip_yaw]");
  EXPECT_EQ(names.Label("bridge_status_t", "drive_state[11]"), "drive_state[left_ankle_roll]");
  EXPECT_EQ(names.Label("ground_truth_t", "foot_wrench[1].force[2]"), "foot_wrench[left].force[2]");
  EXPECT_EQ(names.Joint(3), "right_knee_pitch");
  EXPECT_EQ(names.Joint(12), "joint 12");
  EXPECT_EQ(names.Joint(-1), "joint -1");
}

TEST(ElementNames, LeavesAloneWhatHasNoNames) {
  const ElementNames names = ElementNames::OfSpec(MakeTestSpec());
  for (const char* path :
       {"base_position[2]", "num_joints", "joint_position", "joint_position[12]",
        "joint_position[-1]", "joint_position[03]", "joint_position[", "joint_position]3[",
        "joint_position.x[3]", "nothing[3]", "", "[3]", "joint_position[right_knee_pitch]"}) {
    EXPECT_EQ(names.Label("robot_state_t", path), path);
  }
  EXPECT_EQ(ElementNames().Label("robot_state_t", "joint_position[3]"), "joint_position[3]");
  EXPECT_EQ(ElementNames::OfTexts("no robot", "").Joint(3), "joint 3");
}

TEST(ElementNames, TakesAFootByItsLinkToo) {
  const ElementNames names = ElementNames::OfSpec(MakeTestSpec());
  EXPECT_EQ(names.Label("joint_command_t", "foot_wrench[left_foot].force"),
            "foot_wrench[left].force");
  EXPECT_EQ(names.Label("joint_command_t", "torque[left_foot]"), "torque[left_foot]");
}

TEST(ElementNames, ANameThatNoPathCanHoldIsNotUsed) {
  const std::string robot = RobotFile("dyros_legs.pbtxt");
  const std::string urdf = RobotFile("dyros_legs.urdf");
  for (const char* odd : {"right.knee", "right[knee]", "right knee", "3", "a,b"}) {
    const ElementNames names = ElementNames::OfTexts(Replaced(robot, "right_knee_pitch", odd),
                                                     Replaced(urdf, "right_knee_pitch", odd));
    EXPECT_EQ(names.Label("joint_command_t", "torque[3]"), "torque[3]") << odd;
    EXPECT_EQ(names.Label("joint_command_t", "conditions_met[0]"), "conditions_met[right]") << odd;
  }
}

}  // namespace
}  // namespace poise::logging
