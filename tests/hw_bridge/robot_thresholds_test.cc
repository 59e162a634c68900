// The bridge's thresholds: the paper's robot's as the documentation has them, and how they grow.
#include "hw_bridge/robot_thresholds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "components/framework/configuration/configuration.h"
#include "components/robot_files/robot_files.h"

namespace poise {
namespace {

using ::testing::Each;
using ::testing::SizeIs;

RobotThresholds Of(const std::function<void(Robot*)>& edit) {
  const std::string folder = POISE_SOURCE_DIR "/deploy/robots/dyros/";
  Robot description;
  ReadTextProto(folder + "dyros_legs.pbtxt", &description);
  edit(&description);
  return DeriveThresholds(robot::MakeRobot(description, ReadFile(folder + "dyros_legs.urdf")));
}

// docs/reference/robots.md has the same figures; recorded runs hold their bits.
TEST(RobotThresholds, OfThePapersRobotAreTheDocumentedOnes) {
  const RobotThresholds derived = Of([](Robot*) {});
  EXPECT_EQ(derived.slew_limit, 20000);
  EXPECT_EQ(derived.torque_error, 20);
  EXPECT_EQ(derived.frozen_torque, 20);
  EXPECT_THAT(derived.hold_stiffness, SizeIs(12));
  EXPECT_THAT(derived.hold_stiffness, Each(600));
  EXPECT_THAT(derived.hold_damping, Each(10));
  EXPECT_THAT(derived.damping, Each(20));
}

TEST(RobotThresholds, FollowTheMotors) {
  const RobotThresholds derived = Of([](Robot* robot) {
    robot->mutable_motor(0)->set_peak_current(15);  // 75 N·m at each joint
    robot->mutable_motor(0)->set_rotor_inertia(2e-5);
    robot->mutable_motor(0)->set_static_friction(3);
  });
  EXPECT_EQ(derived.slew_limit, 10000);
  EXPECT_EQ(derived.torque_error, 10);
  EXPECT_EQ(derived.frozen_torque, 12) << "four times the friction is more";
  EXPECT_THAT(derived.hold_stiffness, Each(600));
  EXPECT_THAT(derived.hold_damping, Each(::testing::DoubleNear(5, 1e-12)));
}

TEST(RobotThresholds, AWeakJointIsHeldMoreSoftly) {
  const RobotThresholds derived = Of([](Robot* robot) {
    Motor* const weak = robot->add_motor();
    *weak = robot->motor(0);
    weak->clear_joint();
    weak->add_joint("right_hip_yaw");
    weak->set_peak_current(15);
    weak->set_torque_constant(0.01);  // 7.5 N·m
    weak->set_rotor_inertia(0);
    auto* const joints = robot->mutable_motor(0)->mutable_joint();
    joints->erase(joints->begin());
  });
  EXPECT_EQ(derived.hold_stiffness[0], 60);
  EXPECT_NEAR(derived.hold_damping[0], 1, 1e-12) << "no rotor to go by";
  EXPECT_EQ(derived.hold_stiffness[1], 600);
}

TEST(RobotThresholds, HoldAHigherRobotMoreStiffly) {
  EXPECT_THAT(
      Of([](Robot* robot) { robot->mutable_stance()->set_com_height(0.375); }).hold_stiffness,
      Each(300));
}

}  // namespace
}  // namespace poise
