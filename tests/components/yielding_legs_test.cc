// What a leg is given whose foot the ground does not bear: closed forms of its definition.
#include "components/redistributor/yielding_legs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <vector>

#include "tests/components/control_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using robot::Foot;
using robot::TestRobot;

constexpr robot::FootArray<bool> kBoth(true);
constexpr double kTickPeriod = 2e-3;  // s
constexpr double kAsked = 250;        // N on each foot

class YieldingLegsTest : public testing::Test {
 protected:
  YieldingLegsTest() {
    MessageTraits<joint_command_t>::Resize(command_, std::array{model_.num_joints(), 2});
    std::uniform_real_distribution<double> value(-1, 1);
    for (double& torque : command_.torque) torque = 50 * value(random_);
    for (double& velocity : measured_.joint_velocity) velocity = 3 * value(random_);
    for (wrench_t& wrench : command_.foot_wrench) wrench.force[2] = -kAsked;
    Bear(kAsked, kAsked);
  }
  void Bear(double right, double left) {
    measured_.foot_wrench[0].force[2] = -right;
    measured_.foot_wrench[1].force[2] = -left;
  }
  std::vector<double> Yielded(const robot::FootArray<bool>& in_contact = kBoth) const {
    YieldingLegs legs = Standing();
    return Settled(&legs, in_contact, command_);
  }
  /// After 0.2 s of the same load, 20 times what it is averaged over.
  std::vector<double> Settled(YieldingLegs* legs, const robot::FootArray<bool>& in_contact,
                              const joint_command_t& given) const {
    joint_command_t command;
    for (int tick = 0; tick < 100; ++tick) {
      command = given;
      legs->Yield(in_contact, measured_, &command);
    }
    return command.torque;
  }
  /// Both feet have borne their load since they landed.
  YieldingLegs Standing() const {
    joint_command_t command = command_;
    for (wrench_t& wrench : command.foot_wrench) wrench.force[2] = -kAsked;
    robot_state_t borne = measured_;
    for (wrench_t& wrench : borne.foot_wrench) wrench.force[2] = -kAsked;
    YieldingLegs legs(model_, kTickPeriod);
    for (int tick = 0; tick < 100; ++tick) legs.Yield(kBoth, borne, &command);
    return legs;
  }
  /// By the joints' names.
  std::vector<bool> Leg(Foot foot) const {
    std::vector<bool> leg;
    for (const robot::Joint& joint : model_.joints()) {
      leg.push_back(joint.name.starts_with(foot == Foot::kRight ? "right_" : "left_"));
    }
    return leg;
  }
  /// N that leave a foot's torque as it is.
  double Needed() const { return 0.6 * (kAsked - 0.1 * model_.total_mass() * robot::kGravity); }
  double Damping(size_t joint) const { return model_.motors()[joint].reflected_inertia / 0.005; }

  std::mt19937 random_{TestSeed(53)};
  robot::RobotModel model_ = robot::LoadTestRobot(TestRobot::kDyros);
  robot_state_t measured_ = StateMessage(model_, StandingState(model_));
  joint_command_t command_{};
};

TEST_F(YieldingLegsTest, AFootThatBearsMostLeavesEveryBitOfTheTorque) {
  Bear(0.6 * kAsked, 5 * kAsked);
  EXPECT_EQ(Yielded(), command_.torque);
  Bear(Needed() + 1e-3, kAsked);
  EXPECT_EQ(Yielded(), command_.torque);
}

TEST_F(YieldingLegsTest, AFootWithoutLoadDampsItsLegAlone) {
  Bear(0, kAsked);
  const std::vector<double> torque = Yielded();
  const std::vector<bool> right = Leg(Foot::kRight);
  for (size_t j = 0; j < torque.size(); ++j) {
    const double expected =
        right[j] ? -Damping(j) * measured_.joint_velocity[j] : command_.torque[j];
    EXPECT_NEAR(torque[j], expected, 1e-6) << j;
  }
}

TEST_F(YieldingLegsTest, LessIsGivenInProportion) {
  Bear(kAsked, 0.25 * Needed());
  const std::vector<double> torque = Yielded();
  const std::vector<bool> left = Leg(Foot::kLeft);
  for (size_t j = 0; j < torque.size(); ++j) {
    const double expected =
        left[j] ? 0.25 * command_.torque[j] - 0.75 * Damping(j) * measured_.joint_velocity[j]
                : command_.torque[j];
    EXPECT_NEAR(torque[j], expected, 1e-6) << j;
  }
}

// In flight a leg's torque turns the body.
TEST_F(YieldingLegsTest, ALegInTheAirYieldsOnceTheGroundBearsNextToNothing) {
  const std::vector<bool> right = Leg(Foot::kRight);
  for (const double borne : {0.0, 0.1, 0.25, 1.0}) {
    Bear(borne * Needed(), 0);
    const std::vector<double> torque = Yielded({true, false});
    for (size_t j = 0; j < torque.size(); ++j) {
      const double share = right[j] ? borne : std::min(1.0, 4 * borne);
      const double damped = -Damping(j) * measured_.joint_velocity[j];
      EXPECT_NEAR(torque[j], share * command_.torque[j] + (1 - share) * damped, 1e-5)
          << j << " of " << borne;  // e^-20 of the load before is left
    }
  }
}

TEST_F(YieldingLegsTest, AFootThatIsToPullYields) {
  YieldingLegs legs = Standing();
  joint_command_t command = command_;
  command.foot_wrench[0].force[2] = kAsked;
  Bear(0, kAsked);
  const std::vector<double> torque = Settled(&legs, kBoth, command);
  const std::vector<bool> right = Leg(Foot::kRight);
  for (size_t j = 0; j < torque.size(); ++j) {
    if (!right[j]) continue;
    EXPECT_NEAR(torque[j], -Damping(j) * measured_.joint_velocity[j], 1e-6) << j;
  }
}

TEST_F(YieldingLegsTest, WhatAReadingMayHideIsBorne) {
  Bear(0, kAsked);
  measured_.foot_wrench_deviation[0].force[2] = Needed() / 2 + 1e-3;
  EXPECT_EQ(Yielded(), command_.torque);
}

// A foot that was told down a millimetre early has to find the ground by its torque.
TEST_F(YieldingLegsTest, AFootThatLandsPressesUntilItHasBorneItsLoad) {
  YieldingLegs legs = Standing();
  const auto torque = [&](const robot::FootArray<bool>& in_contact, double left, double asked) {
    joint_command_t command = command_;
    command.foot_wrench[1].force[2] = -asked;
    Bear(kAsked, left);
    return Settled(&legs, in_contact, command);
  };
  torque({true, false}, 0, 0);
  EXPECT_EQ(torque(kBoth, 300, 5), command_.torque) << "an impact";
  EXPECT_EQ(torque(kBoth, 0, kAsked), command_.torque) << "it is not on the ground";
  EXPECT_EQ(torque(kBoth, kAsked, kAsked), command_.torque);
  EXPECT_NE(torque(kBoth, 0, kAsked), command_.torque) << "it was, and is kicked away";
}

TEST_F(YieldingLegsTest, AFootThatBouncesStands) {
  YieldingLegs legs = Standing();
  for (int tick = 0; tick < 20; ++tick) {
    joint_command_t command = command_;
    Bear(tick % 2 == 0 ? 0 : 2 * kAsked, kAsked);
    legs.Yield(kBoth, measured_, &command);
    ASSERT_EQ(command.torque, command_.torque) << tick;
  }
}

TEST_F(YieldingLegsTest, NothingYieldsThatIsNotAsked) {
  Bear(0, 0);
  EXPECT_EQ(Yielded({false, false}), command_.torque) << "swinging feet";
  for (wrench_t& wrench : command_.foot_wrench) {
    wrench.force[2] = -0.1 * model_.total_mass() * robot::kGravity;
  }
  EXPECT_EQ(Yielded(), command_.torque) << "feet that are to bear next to nothing";
  for (wrench_t& wrench : command_.foot_wrench) wrench.force[2] = -kAsked;
  Bear(std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(Yielded(), command_.torque) << "a reading that is no number";
}

}  // namespace
}  // namespace poise
