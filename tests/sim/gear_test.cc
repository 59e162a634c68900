// Play and compliance of a drivetrain's gear between the rotor and one inertia, integrated here
// without an engine.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "sim/drivetrain.h"

namespace poise {
namespace {

constexpr double kRotor = 0.1;  // kg·m², reflected
constexpr double kLink = 0.8;   // kg·m²

robot::MotorModel Motor(double coulomb = 0, double viscous = 0) {
  robot::MotorModel motor;
  motor.reflected_inertia = kRotor;
  motor.coulomb_friction = motor.static_friction = coulomb;
  motor.viscous_friction = viscous;
  motor.stribeck_velocity = 0.05;
  return motor;
}

robot::Joint FreeJoint() {
  robot::Joint joint;
  joint.lower = -std::numeric_limits<double>::infinity();
  joint.upper = std::numeric_limits<double>::infinity();
  return joint;
}

Drivetrain::Options Gear(double backlash, double stiffness, double damping) {
  Drivetrain::Options options;
  options.backlash = backlash;
  options.gear_stiffness = stiffness;
  options.gear_damping = damping;
  return options;
}

// I qd' = I qd + h (torque + lambda), lambda = (row.velocity - qd') / row.cfm.
struct Load {
  Drivetrain drivetrain;
  double h = 1e-3;
  double inertia = kLink;
  double q = 0, qd = 0;

  void Step(double motor_torque, double link_torque) {
    const JointRow row = drivetrain.Begin(h, q, qd, motor_torque);
    const double gain = row.active ? h / row.cfm : 0;
    qd = (inertia * qd + h * (link_torque + row.torque) + gain * row.velocity) / (inertia + gain);
    q += h * qd;
    drivetrain.End(h, qd);
  }
  double twist() const { return drivetrain.rotor_position() - q; }
  double momentum() const { return inertia * qd + kRotor * drivetrain.rotor_velocity(); }
};

TEST(Gear, WindsUpByTorqueOverStiffness) {
  for (const double torque : {30.0, -30.0}) {
    Load load{Drivetrain(FreeJoint(), Motor(0, 5), Gear(2e-3, 1e4, 20))};
    for (int i = 0; i < 5000; ++i) load.Step(torque, -torque);
    EXPECT_NEAR(load.twist(), std::copysign(1e-3 + 30 / 1e4, torque), 1e-9);
    EXPECT_NEAR(load.drivetrain.gear_torque(), torque, 1e-6);
  }
}

TEST(Gear, IsPlacedWhereItCarriesTheTorque) {
  for (const double torque : {12.0, -12.0}) {
    Load load{Drivetrain(FreeJoint(), Motor(), Gear(2e-3, 1e4, 0))};
    load.q = 0.3;
    load.drivetrain.Place(0.3, 0, torque);
    for (int i = 0; i < 100; ++i) load.Step(torque, -torque);
    EXPECT_NEAR(load.q, 0.3, 1e-12);
    EXPECT_NEAR(load.twist(), std::copysign(1e-3 + 12 / 1e4, torque), 1e-12);
  }
}

// tan(w_h h / 2) = w h / 2 for average acceleration, w^2 = k (1/I + 1/J); nothing is damped.
TEST(Gear, RotorAndLinkRingAtTheirTwoMassFrequency) {
  for (const double stiffness : {2e3, 2e4, 9e4}) {
    for (const double h : {1e-3, 1e-4}) {
      Load load{Drivetrain(FreeJoint(), Motor(), Gear(0, stiffness, 0)), h};
      load.drivetrain.Place(0, 0, 10);  // wound, then let go
      std::vector<double> twist;
      for (int i = 0; i < 20000; ++i) {
        twist.push_back(load.twist());
        load.Step(0, 0);
      }
      double cross = 0, square = 0;
      for (size_t i = 1; i + 1 < twist.size(); ++i) {
        cross += twist[i] * (twist[i - 1] + twist[i + 1]);
        square += twist[i] * twist[i];
      }
      const double measured = std::acos(cross / square / 2) / h;
      const double omega = std::sqrt(stiffness * (1 / kRotor + 1 / kLink));
      EXPECT_NEAR(measured, 2 / h * std::atan(omega * h / 2), 1e-6 * omega);
      if (omega * h < 0.1) {
        EXPECT_NEAR(measured, omega, 1e-3 * omega);
      }
      const auto [low, high] = std::minmax_element(twist.end() - 5000, twist.end());
      const auto [first_low, first_high] = std::minmax_element(twist.begin(), twist.begin() + 5000);
      EXPECT_NEAR((*high - *low) / (*first_high - *first_low), 1, 1e-3) << "lost or gained";
    }
  }
}

TEST(Gear, DampingDecaysTheRing) {
  const double stiffness = 2e4, damping = 4;
  Load load{Drivetrain(FreeJoint(), Motor(), Gear(0, stiffness, damping)), 1e-5};
  load.drivetrain.Place(0, 0, 10);
  const double reduced = 1 / (1 / kRotor + 1 / kLink);
  const double omega = std::sqrt(stiffness / reduced), rate = damping / reduced / 2;
  const int period = static_cast<int>(
      std::lround(2 * std::numbers::pi / std::sqrt(omega * omega - rate * rate) / load.h));
  const double before = load.twist();
  for (int i = 0; i < period; ++i) load.Step(0, 0);
  EXPECT_NEAR(std::log(before / load.twist()), rate * period * load.h, 5e-3);
}

// Rotor and link together gain what the torques give, whatever the gear does between them: the
// rotor's inertia is there once.
TEST(Gear, MomentumIsThatOfTheTorques) {
  for (const double backlash : {0.0, 3e-3}) {
    for (const double stiffness : {0.0, 2e4}) {
      if (backlash + stiffness <= 0) continue;
      Load load{Drivetrain(FreeJoint(), Motor(), Gear(backlash, stiffness, 5))};
      double impulse = 0;
      for (int i = 0; i < 3000; ++i) {
        const double motor = 8 * std::sin(0.03 * i), link = i < 1000 ? 1.0 : -0.4;
        load.Step(motor, link);
        impulse += load.h * (motor + link);
        ASSERT_NEAR(load.momentum(), impulse, 1e-10);
      }
    }
  }
}

TEST(Gear, AStiffOneIsTheRigidOne) {
  Load stiff{Drivetrain(FreeJoint(), Motor(0, 0.5), Gear(0, 1e6, 300))};
  Load rigid{Drivetrain(FreeJoint(), Motor(0, 0.5), Gear(0, 0, 0))};
  for (int i = 0; i < 1000; ++i) {
    stiff.Step(3, -1);
    rigid.Step(3, -1);
  }
  EXPECT_GT(rigid.qd, 1);
  EXPECT_NEAR(stiff.qd, rigid.qd, 1e-5);
  EXPECT_NEAR(stiff.q, rigid.q, 1e-5);
}

// From one flank to the other the rotor is alone: b = torque t^2 / (2 I).
TEST(Backlash, TheRotorCrossesThePlayAlone) {
  const double play = 4e-3, torque = 2;
  Load load{Drivetrain(FreeJoint(), Motor(), Gear(play, 0, 0)), 1e-4};
  load.drivetrain.Place(0, 0, -1e-9);
  int steps = 0;
  while (load.qd == 0 && steps < 10000) {
    load.Step(torque, 0);
    ++steps;
  }
  EXPECT_NEAR(steps * load.h, std::sqrt(2 * play * kRotor / torque), 2 * load.h);
}

// The rotor is led slowly to and fro; the link, which drags in oil, follows on the flank and stands
// still for the play at each reversal.
TEST(Backlash, TheLinkLagsByThePlay) {
  const double play = 5e-3, amplitude = 0.05, drag = 20;
  Load load{Drivetrain(FreeJoint(), Motor(), Gear(play, 0, 0))};
  double low = 0, high = 0, up = 0, down = 0;
  const double period = 20;
  for (int i = 0; i < 40000; ++i) {
    const double phase = 2 * std::numbers::pi * i * load.h / period;
    const double target = amplitude * std::sin(phase);
    const double motor =
        2e4 * (target - load.drivetrain.rotor_position()) - 60 * load.drivetrain.rotor_velocity();
    load.Step(motor, -drag * load.qd);
    if (i < 20000) continue;  // first round: from the middle of the play
    low = std::min(low, load.q);
    high = std::max(high, load.q);
    const double crossing = load.drivetrain.rotor_position();
    if (std::abs(crossing) < 3e-5) (std::cos(phase) > 0 ? up : down) = load.q;
  }
  EXPECT_NEAR(high, amplitude - play / 2, 5e-5);
  EXPECT_NEAR(low, -amplitude + play / 2, 5e-5);
  EXPECT_NEAR(down - up, play, 1e-4) << "width of the hysteresis";
}

TEST(Backlash, FlanksPushAndNeverPull) {
  Load load{Drivetrain(FreeJoint(), Motor(), Gear(3e-3, 2e4, 30))};
  double most = 0;
  for (int i = 0; i < 5000; ++i) {
    load.Step(6 * std::sin(0.05 * i), 3 * std::cos(0.013 * i));
    const double torque = load.drivetrain.gear_torque();
    most = std::max(most, std::abs(torque));
    if (std::abs(torque) > 0.5) {
      ASSERT_GT(torque * load.twist(), 0) << i;
    }
  }
  EXPECT_GT(most, 5);
}

TEST(Backlash, RattlingTakesEnergyAndNeverGives) {
  for (const double stiffness : {0.0, 2e4}) {
    for (const double h : {1e-3, 5e-4}) {
      Load load{Drivetrain(FreeJoint(), Motor(), Gear(3e-3, stiffness, 5)), h};
      load.drivetrain.Place(0, 0, -1e-9);
      load.qd = 0.5;
      const double start = kLink * load.qd * load.qd / 2;
      double worst = 0;
      for (int i = 0; i < 20000; ++i) {
        load.Step(0, 0);
        const double w = load.drivetrain.rotor_velocity();
        worst = std::max(worst, (kLink * load.qd * load.qd + kRotor * w * w) / 2);
      }
      EXPECT_LE(worst, start * (1 + 1e-9)) << stiffness << " " << h;
      // In the end both drift together.
      const double together = kLink * 0.5 / (kLink + kRotor);
      EXPECT_NEAR(load.qd, together, 0.02 * together);
    }
  }
}

TEST(Gear, StableForAnyStiffnessAndStep) {
  for (const double backlash : {0.0, 1e-3}) {
    for (const double stiffness : {1e2, 2e4, 1e5, 1e8}) {
      Load load{Drivetrain(FreeJoint(), Motor(2, 0.5), Gear(backlash, stiffness, 0)), 2e-3};
      load.inertia = 1e-3;
      load.qd = 5;
      for (int i = 0; i < 5000; ++i) {
        load.Step(i % 7 == 0 ? 1.0 : -0.5, 0);
        ASSERT_LT(std::abs(load.qd), 30) << stiffness << " " << i;
        ASSERT_LT(std::abs(load.drivetrain.rotor_velocity()), 5);
      }
    }
  }
}

// Friction sits at the motor: a link pushed with less than it bends gear and bristle and stays.
TEST(Gear, FrictionHoldsTheRotor) {
  Load load{Drivetrain(FreeJoint(), Motor(2, 0.5), Gear(0, 5e3, 20))};
  for (int i = 0; i < 20000; ++i) load.Step(0, std::min(1.0, 1e-3 * i));
  const double bristle = 1.0 / 1e4;
  EXPECT_NEAR(load.drivetrain.rotor_position(), bristle, 1e-5);
  EXPECT_NEAR(load.q, bristle + 1.0 / 5e3, 1e-5);
  EXPECT_NEAR(load.drivetrain.friction_torque(), -1, 1e-6);
}

TEST(Gear, TheStopIsAtTheLink) {
  robot::Joint joint = FreeJoint();
  joint.upper = 0.1;
  Load load{Drivetrain(joint, Motor(0, 0.5), Gear(0, 1e4, 20))};
  for (int i = 0; i < 5000; ++i) load.Step(50, 0);
  EXPECT_NEAR(load.q, 0.1 + 50 / 5e4, 1e-5);
  EXPECT_NEAR(load.drivetrain.rotor_position(), load.q + 50 / 1e4, 1e-5);
}

}  // namespace
}  // namespace poise
