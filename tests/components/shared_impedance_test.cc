// What the drives are told to hold beside the torque.
#include <gtest/gtest.h>

#include "tests/components/redistributor_chain.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using robot::TestRobot;

// On two feet.
Chain ChainWith(const std::string& redistributor) {
  return {TestRobot::kDyros, "phase { support: DOUBLE }", MonitorConfig(false), redistributor};
}

// The drives are told the motion that the torque causes, by the square route's accelerations, and
// the torque stays what it is without them.
TEST(SharedImpedanceTest, PlansTheMotionThatTheTorqueCauses) {
  std::mt19937 random{TestSeed(29)};
  Chain alone = ChainWith(RedistributorText());
  Chain shared = ChainWith(RedistributorText("impedance { enabled: true }"));
  const robot::RobotModel& model = alone.model();
  const robot::RobotState state = Disturbed(StandingState(model), 0.03, 0.2, &random);
  const double horizon = model.drive_train().sensor_delay + 0.5e-6 * kTickMicroseconds;
  const joint_command_t& plain = alone.Run(state, 0);
  const joint_command_t& out = shared.Run(state, 0);
  ASSERT_NE(out.status, joint_command_t::STATUS_INVALID_INPUT);

  Eigen::VectorXd q, wrench;
  Dynamics(model, state, {true, true}).Forward(ToEigen(out.torque), &q, &wrench);
  for (Eigen::Index j = 0; j < model.num_joints(); ++j) {
    const auto i = static_cast<size_t>(j);
    const double a = q[6 + j], t = horizon;
    EXPECT_EQ(out.torque[i], plain.torque[i]);
    EXPECT_NEAR(out.velocity[i], state.joint_velocity[j] + a * t, 1e-6);
    EXPECT_NEAR(out.position[i],
                state.joint_position[j] + t * (state.joint_velocity[j] + a * t / 2), 1e-8);
    EXPECT_GT(out.damping[i], 0);
    EXPECT_GT(out.stiffness[i], 0);
    EXPECT_EQ(plain.position[i] + plain.velocity[i] + plain.stiffness[i] + plain.damping[i], 0);
  }
}

TEST(SharedImpedanceTest, RefusesATimeThatIsNone) {
  EXPECT_EQ(RefusedField("impedance { enabled: true rotor_time: 0 }"), "impedance.rotor_time");
}

}  // namespace
}  // namespace poise
