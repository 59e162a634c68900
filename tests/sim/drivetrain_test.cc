// The drivetrain's row on one inertia, integrated here without an engine.
#include "sim/drivetrain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/test_seed.h"

namespace poise {
namespace {

constexpr double kInertia = 0.8;  // kg·m², of the load
constexpr double kStep = 1e-3;

robot::MotorModel Motor(double inertia, double coulomb, double viscous,
                        double static_friction = 0) {
  robot::MotorModel motor;
  motor.reflected_inertia = inertia;
  motor.coulomb_friction = coulomb;
  motor.viscous_friction = viscous;
  motor.static_friction = std::max(static_friction, coulomb);
  motor.stribeck_velocity = 0.05;
  return motor;
}

robot::Joint FreeJoint() {
  robot::Joint joint;
  joint.lower = -std::numeric_limits<double>::infinity();
  joint.upper = std::numeric_limits<double>::infinity();
  return joint;
}

// I qd' = I qd + h (row.torque + lambda), lambda = (row.velocity - qd') / row.cfm.
struct Load {
  Drivetrain drivetrain;
  double inertia = kInertia, h = kStep;
  double q = 0, qd = 0;

  void Step(double torque, const DriveImpedance& drive = {}) {
    const JointRow row = drivetrain.Begin(h, q, qd, torque, drive);
    const double gain = row.active ? h / row.cfm : 0;
    qd = (inertia * qd + h * row.torque + gain * row.velocity) / (inertia + gain);
    q += h * qd;
    drivetrain.End(h, qd);
  }
};

TEST(Drivetrain, NothingToDoMeansNoRow) {
  Drivetrain drivetrain(FreeJoint(), Motor(0, 0, 0), {});
  EXPECT_FALSE(drivetrain.Begin(kStep, 0.1, 2.0, 0).active);
}

TEST(Drivetrain, SwitchesTurnInertiaAndFrictionOff) {
  Drivetrain drivetrain(FreeJoint(), Motor(0.1, 2, 0.5), {.inertia = false, .friction = false});
  EXPECT_FALSE(drivetrain.Begin(kStep, 0.1, 2.0, 0).active);
}

TEST(Drivetrain, RotorInertiaAddsToTheLoad) {
  Load load{Drivetrain(FreeJoint(), Motor(0.25, 0, 0), {})};
  for (int i = 0; i < 1000; ++i) load.Step(3.0);
  EXPECT_NEAR(load.qd, 3.0 / (kInertia + 0.25) * 1.0, 1e-12);
}

// A mass on a spring and damper, let go at rest: x = a - a e^{-dt} (cos wt + d/w sin wt).
TEST(Drivetrain, ADrivesImpedanceIsASpringAndADamper) {
  const double inertia = kInertia + 0.2, stiffness = 400, damping = 8, target = 0.1;
  const double decay = damping / (2 * inertia);
  const double frequency = std::sqrt(stiffness / inertia - decay * decay);
  double worst_before = 0;
  for (const double h : {2e-4, 1e-4}) {
    Load load{Drivetrain(FreeJoint(), Motor(0.2, 0, 0), {})};
    load.h = h;
    double worst = 0;
    for (double t = h; t < 0.5; t += h) {
      load.Step(0, {.stiffness = stiffness, .damping = damping, .position = target});
      const double x =
          target - target * std::exp(-decay * t) *
                       (std::cos(frequency * t) + decay / frequency * std::sin(frequency * t));
      worst = std::max(worst, std::abs(load.q - x));
    }
    EXPECT_LT(worst, 10 * h * target * frequency / 2);
    if (worst_before > 0) {
      EXPECT_NEAR(worst, worst_before / 2, worst_before / 20);  // first order
    }
    worst_before = worst;
  }
}

TEST(Drivetrain, ADrivesImpedanceIsStableHoweverStiff) {
  for (const bool elastic : {false, true}) {
    Load load{Drivetrain(FreeJoint(), Motor(0.01, 0, 0),
                         {.gear_stiffness = elastic ? 6e4 : 0.0, .gear_damping = 7})};
    for (int i = 0; i < 2000; ++i) {
      load.Step(0, {.stiffness = 1e7, .damping = 1e6, .position = 0.3});
      ASSERT_LT(std::abs(load.q), 0.7);
    }
    EXPECT_NEAR(load.q, 0.3, 1e-3);
  }
}

// Momentum: what the drive says it gave is what load and rotor have gained.
TEST(Drivetrain, ADriveSaysWhatItGave) {
  Load load{Drivetrain(FreeJoint(), Motor(0.2, 0, 0), {})};
  double impulse = 0;
  for (int i = 0; i < 300; ++i) {
    load.Step(1.5, {.stiffness = 200, .damping = 5, .position = 0.2, .velocity = 0.7});
    impulse += load.h * (1.5 + load.drivetrain.drive_torque());
  }
  EXPECT_NEAR(impulse, (kInertia + 0.2) * load.qd, 1e-12);
  load.Step(1.5);
  EXPECT_EQ(load.drivetrain.drive_torque(), 0);
}

TEST(Drivetrain, ViscousFrictionDecaysAsImplicitEuler) {
  Load load{Drivetrain(FreeJoint(), Motor(0.25, 0, 0.5), {})};
  load.qd = 2;
  for (int i = 0; i < 500; ++i) load.Step(0);
  EXPECT_NEAR(load.qd, 2 * std::pow(1 + kStep * 0.5 / (kInertia + 0.25), -500), 1e-12);
  EXPECT_NEAR(load.drivetrain.friction_torque(), -0.5 * load.qd, 1e-12);
}

TEST(Drivetrain, SticksBelowCoulombWithoutDrift) {
  for (const double share : {0.5, 0.95}) {
    Load load{Drivetrain(FreeJoint(), Motor(0.1, 2, 0.5), {})};
    const auto run = [&](double seconds) {
      for (int i = 0; i < static_cast<int>(seconds / kStep); ++i) load.Step(share * 2);
    };
    for (int i = 0; i < 1000; ++i) load.Step(share * 2 * i / 1000);  // a sudden load overshoots
    run(5);
    const double settled = load.q;
    EXPECT_GE(settled, share * 2 / 1e4 - 1e-12);
    EXPECT_LT(settled, 3 * 2 / 1e4) << "slid rather than bent";
    run(10);
    EXPECT_NEAR(load.q, settled, 1e-12);
    EXPECT_NEAR(load.drivetrain.friction_torque(), -share * 2, 1e-9);
  }
}

TEST(Drivetrain, SlidesAboveCoulomb) {
  Load load{Drivetrain(FreeJoint(), Motor(0.1, 2, 0), {})};
  for (int i = 0; i < 1000; ++i) load.Step(2.5);
  const double coasting = load.qd;
  for (int i = 0; i < 1000; ++i) load.Step(2.5);
  EXPECT_NEAR(load.qd - coasting, 0.5 / (kInertia + 0.1), 0.003);  // first order in the step
}

TEST(Drivetrain, SlidingTorqueIsCoulombPlusViscous) {
  for (const double speed : {0.5, -3.0}) {
    Drivetrain drivetrain(FreeJoint(), Motor(0.1, 2, 0.5, 3), {});
    for (int i = 0; i < 2000; ++i) {
      drivetrain.Begin(kStep, 0, speed, 0);
      drivetrain.End(kStep, speed);
    }
    EXPECT_NEAR(drivetrain.friction_torque(), -std::copysign(2 + 0.5 * std::abs(speed), speed),
                1e-9);
  }
}

TEST(Drivetrain, StribeckPeakAtLowSpeed) {
  Drivetrain drivetrain(FreeJoint(), Motor(0.1, 2, 0, 3), {});
  const double speed = 0.02;
  for (int i = 0; i < 5000; ++i) {
    drivetrain.Begin(kStep, 0, speed, 0);
    drivetrain.End(kStep, speed);
  }
  EXPECT_NEAR(drivetrain.friction_torque(), -(2 + std::exp(-0.16)), 1e-6);
}

TEST(Drivetrain, NoiseDoesNotMakeAHeldPostureCreep) {
  Load load{Drivetrain(FreeJoint(), Motor(0.1, 2, 0.5), {})};
  std::mt19937 random(TestSeed(5));
  std::uniform_real_distribution<double> noise(-0.3, 0.3);
  const auto mean_of_second = [&] {
    double sum = 0;
    for (int i = 0; i < 1000; ++i) {
      load.Step(0.8 + noise(random));
      sum += load.q;
    }
    return sum / 1000;
  };
  mean_of_second();
  const double early = mean_of_second();
  for (int second = 0; second < 8; ++second) mean_of_second();
  EXPECT_NEAR(mean_of_second(), early, 2e-6);
}

TEST(Drivetrain, FrictionTakesKineticEnergyAndNeverGives) {
  Load load{Drivetrain(FreeJoint(), Motor(0.1, 2, 0), {})};
  load.qd = 1;
  double energy = load.qd * load.qd;
  // Until it comes to rest: v0 / (F_c / I) = 0.45 s. Then the bristle may swing by what it stores.
  for (int i = 0; i < 440; ++i) {
    load.Step(0);
    EXPECT_LE(load.qd * load.qd, energy);
    energy = load.qd * load.qd;
  }
  for (int i = 0; i < 5000; ++i) load.Step(0);
  EXPECT_NEAR(load.q, 0.5 * (kInertia + 0.1) / 2, 5e-3) << "stopping distance of Coulomb friction";
  EXPECT_NEAR(load.qd, 0, 1e-9);
}

TEST(Drivetrain, StableForAnyStiffnessAndStep) {
  Load load{Drivetrain(FreeJoint(), Motor(0, 2, 0), {.friction_stiffness = 1e8})};
  load.inertia = 1e-3;
  load.h = 2e-3;
  load.qd = 5;
  for (int i = 0; i < 2000; ++i) {
    load.Step(i % 7 == 0 ? 1.0 : -0.5);
    ASSERT_LE(std::abs(load.qd), 5.0);
  }
}

TEST(Drivetrain, StopHoldsAndReleases) {
  robot::Joint joint = FreeJoint();
  joint.lower = -0.5;
  joint.upper = 0.5;
  Load load{Drivetrain(joint, Motor(0.1, 0, 0.5), {})};
  for (int i = 0; i < 3000; ++i) load.Step(100);
  EXPECT_NEAR(load.q, 0.5 + 100 / 5e4, 1e-6);
  EXPECT_NEAR(load.drivetrain.stop_torque(), -100, 1e-3);
  EXPECT_NEAR(load.qd, 0, 1e-6);
  for (int i = 0; i < 100; ++i) load.Step(-5);
  EXPECT_LT(load.q, 0.5);
  EXPECT_EQ(load.drivetrain.stop_torque(), 0);
  for (int i = 0; i < 3000; ++i) load.Step(-100);
  EXPECT_NEAR(load.q, -0.5 - 100 / 5e4, 1e-6);
}

}  // namespace
}  // namespace poise
