// The poles of a standing robot against closed forms, and what the rule makes of robots.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "components/balance/gains/gain_rule.h"
#include "components/robot_files/robot_files.h"
#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

constexpr double kPeriod = 0.002;  // s

std::string Read(const std::string& path) {
  std::ifstream file(std::string(POISE_SOURCE_DIR) + "/deploy/robots/dyros/" + path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The paper's robot with another drive train and rotors of `rotor` kg·m² at the shaft.
robot::RobotModel With(const std::string& drive_train, const std::string& rotor = "4e-5") {
  std::string text = Read("dyros_legs.pbtxt");
  const size_t begin = text.find("drive_train {"), end = text.find('}', begin);
  text.replace(begin, end - begin + 1, "drive_train {" + drive_train + "}");
  const size_t at = text.find("rotor_inertia: 4e-5");
  text.replace(at, 19, "rotor_inertia: " + rotor);
  const size_t viscous = text.find("viscous_friction: 0.5");
  text.replace(viscous, 21, "viscous_friction: 0  ");
  return robot::LoadRobotTexts(text, Read("dyros_legs.urdf"));
}

// Without gear, delay, friction and filter every task is its own pendulum: s² + k_d s + k_p,
// whatever the robot, and the torque that the law computes cancels gravity's stiffness.
TEST(ClosedLoopPoles, OfAnIdealRobotAreThoseOfItsTasks) {
  const robot::RobotModel model = With("");
  StandingGains gains;
  gains.com = gains.orientation = gains.foot = {100, 12};  // −6 ± 8 i
  gains.velocity_cutoff = 1000;  // that and half a tick are 0.3 ms late: ω_c τ is 0.3 %
  const double period = 2e-4;
  for (const auto& in_contact : {kDouble, kRight, kLeft}) {
    const ClosedLoopPoles poles = ComputeClosedLoopPoles(model, gains, in_contact, period);
    EXPECT_TRUE(poles.stable());
    // Each of the motions that the contacts leave: 6 on two feet, 12 on one, a conjugate pair each.
    const size_t motions = in_contact == kDouble ? 6 : 12;
    ASSERT_GE(poles.modes.size(), motions);
    for (size_t i = 0; i < motions; ++i) {
      EXPECT_NEAR(poles.modes[i].s.real(), -6, 0.15) << i;
      EXPECT_NEAR(poles.modes[i].s.imag(), 8, 0.15) << i;
    }
  }
}

// A rotor behind a gear with the links held by their own inertia: at zero gains the two-mass system
// rings with its gear's damping alone, and no mode is faster than the rotor against a fixed link
// with all of the other side's inertia taken away would be.
TEST(ClosedLoopPoles, GearsRingWhereTheRotorsSay) {
  const double gear = 7e4, rotor = 50 * 50 * 4e-5;
  const robot::RobotModel model = With("gear_stiffness: 7e4 gear_damping: 8 torque_lag: 0.0005");
  StandingGains gains;
  gains.com = gains.orientation = gains.foot = {1, 1};
  const ClosedLoopPoles poles = ComputeClosedLoopPoles(model, gains, kDouble, kPeriod);
  // Rotors wound up against each other do not move the links: ω = √(k/J), damped by d/(2 √(k J)).
  // Two feet leave six such motions.
  const double frequency = std::sqrt(gear / rotor) / (2 * M_PI),
               damping = 8 / (2 * std::sqrt(gear * rotor));
  int found = 0;
  for (const auto& mode : poles.modes) {
    if (std::abs(mode.frequency - frequency) < 0.01 * frequency &&
        std::abs(mode.damping - damping) < 0.1 * damping) {
      ++found;
    }
  }
  EXPECT_GE(found, 6);
}

TEST(GainRule, GivesEveryRobotOfOursAMargin) {
  for (const auto& model : {Biped(), Humanoid()}) {
    const StandingGains gains = GainsByRule(*model, kPeriod);
    EXPECT_GT(gains.com.kp, std::pow(PendulumFrequency(*model), 2));
    for (const auto& in_contact : {kDouble, kRight}) {
      // Its arms and knees do not let this robot's COM above one sole at the stance's height.
      if (model->num_joints() > 12 && in_contact == kRight) continue;
      EXPECT_GE(GainMargin(*model, gains, in_contact, kPeriod), 1.5) << model->name();
      EXPECT_GE(DelayMargin(*model, gains, in_contact, kPeriod), 1) << model->name();
      EXPECT_GE(ComputeClosedLoopPoles(*model, gains, in_contact, kPeriod).LeastDamping(20), 0.45)
          << model->name();
    }
  }
}

// Soft gears: the low-pass stays below them, and the margin is there again.
TEST(GainRule, FiltersBelowTheSlowestRotorOnItsGear) {
  const auto heron = [] {
    const std::string path = std::string(POISE_SOURCE_DIR) + "/deploy/robots/heron/heron.pbtxt";
    return robot::LoadRobotFiles(path);
  }();
  // The knees' 1.1e-4 kg·m² behind 1:51, gears of 3e4 N·m/rad.
  EXPECT_NEAR(VelocityCutoff(heron), 0.25 * std::sqrt(3e4 / (51 * 51 * 1.1e-4)) / (2 * M_PI), 1e-9);
  EXPECT_EQ(VelocityCutoff(*Biped()), 20);
  StandingGains gains = GainsByRule(heron, kPeriod);
  for (const auto& in_contact : {kDouble, kRight}) {
    EXPECT_GE(GainMargin(heron, gains, in_contact, kPeriod), 2);
  }
  gains.velocity_cutoff = gains.base_velocity_cutoff = 20;
  EXPECT_LT(GainMargin(heron, gains, kRight, kPeriod), 1.5);
}

// What the low-pass on the base's velocity is for: gears that ring between motor and link.
TEST(GainRule, FiltersWhatGearsWouldRingWith) {
  const auto model = Biped();
  StandingGains gains = GainsByRule(*model, kPeriod);
  const double with = GainMargin(*model, gains, kDouble, kPeriod, 6);
  gains.base_velocity_cutoff = 0;
  EXPECT_GT(with, 1.2 * GainMargin(*model, gains, kDouble, kPeriod, 6));
}

TEST(GainRule, FollowsTheRobotsSize) {
  const auto model = Biped();
  const StandingGains gains = GainsByRule(*model, kPeriod);
  const double omega = PendulumFrequency(*model);
  EXPECT_NEAR(omega, std::sqrt(9.80665 / 0.75), 1e-9);  // the stance's COM height
  EXPECT_NEAR(gains.com.kp, std::pow(2.75 * omega, 2), 1e-9);
  EXPECT_NEAR(gains.com.kd, 1.4 * 2.75 * omega, 1e-9);
  // A longer delay takes from the gains.
  EXPECT_LT(GainsByRule(With("sensor_delay: 0.03"), kPeriod).com.kd, gains.com.kd);
}

}  // namespace
}  // namespace poise::balance
