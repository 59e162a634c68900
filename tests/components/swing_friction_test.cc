// What the swinging leg's motors are given against friction: a single joint's closed form, and the
// chain's command by the square route's accelerations.
#include "components/redistributor/swing_friction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fmt/format.h"
#include "tests/components/redistributor_chain.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using robot::TestRobot;

constexpr double kPeriod = 2e-3;  // s
constexpr double kShare = 0.8;    // as walking has it
constexpr double kLead = 0.02;    // s, the field's default

FrictionCompensation Config(double share) {
  FrictionCompensation config;
  config.set_share(share);
  return config;
}

/// On its right foot for so long that the left leg's share is all there.
SwingFriction OnTheRightFoot(const robot::RobotModel& model, double share) {
  SwingFriction friction(Config(share), model, kPeriod);
  for (int tick = 0; tick < 100; ++tick) friction.Ramp({true, false}, false, 1);
  return friction;
}

int AnkleOf(const robot::RobotModel& model, robot::Foot foot) {
  return model.supporting_joints(model.feet()[foot].body)[0];
}

// A joint of inertia J with Coulomb and viscous friction, PD by a model without friction, and dry
// friction that holds it while the motor asks for less.
class JointWithFriction {
 public:
  static constexpr double kInertia = 0.01, kKp = 625, kKd = 50;

  JointWithFriction(TestRobot robot, double share)
      : model_(robot::LoadTestRobot(robot)),
        joint_(AnkleOf(model_, robot::Foot::kLeft)),
        motor_(model_.motors()[static_cast<size_t>(joint_)]),
        friction_(OnTheRightFoot(model_, share)) {}

  /// Returns the reference's error after `time` s of one that moves with `speed` from `start` on.
  double Error(double start, double speed, double time) {
    Eigen::VectorXd velocity = Eigen::VectorXd::Zero(model_.num_joints());
    Eigen::VectorXd acceleration = velocity;
    std::vector<double> torque(static_cast<size_t>(model_.num_joints()));
    double& motor_torque = torque[static_cast<size_t>(joint_)];
    double q = 0, qd = 0, reference = start;
    constexpr double kStep = 1e-5;
    for (int step = 0; step < static_cast<int>(time / kStep); ++step) {
      reference += kStep * speed;
      velocity[joint_] = qd;
      acceleration[joint_] = kKp * (reference - q) + kKd * (speed - qd);
      motor_torque = kInertia * acceleration[joint_];
      friction_.Add(velocity, acceleration, torque);
      // Implicit: friction takes the velocity to zero at most.
      const double free = kInertia * qd + kStep * motor_torque;
      const double held = std::max(std::abs(free) - kStep * motor_.coulomb_friction, 0.0);
      qd = std::copysign(held, free) / (kInertia + kStep * motor_.viscous_friction);
      q += kStep * qd;
    }
    return reference - q;
  }
  const robot::MotorModel& motor() const { return motor_; }

 private:
  robot::RobotModel model_;
  int joint_;
  robot::MotorModel motor_;
  SwingFriction friction_;
};

// At a steady speed v, tanh(v / smoothing) = 1, the motor's torque is the friction:
// J kp e + s (τ_c + d (v + lead kp e)) = τ_c + d v.
TEST(SwingFrictionTest, LeavesOfALagWhatTheShareLeaves) {
  for (const double share : {0.0, 0.5, kShare, 1.0}) {
    for (const double speed : {-1.0, 0.7}) {
      JointWithFriction joint(TestRobot::kDyros, share);
      const double coulomb = joint.motor().coulomb_friction,
                   damping = joint.motor().viscous_friction;
      ASSERT_GT(coulomb, 0);
      ASSERT_GT(damping, 0);
      constexpr double kStiffness = JointWithFriction::kInertia * JointWithFriction::kKp;
      const double expected = (1 - share) * (std::copysign(coulomb, speed) + damping * speed) /
                              (kStiffness + share * damping * kLead * JointWithFriction::kKp);
      EXPECT_NEAR(joint.Error(0, speed, 3), expected, 1e-3 * std::abs(expected) + 1e-5)
          << share << " " << speed;
    }
  }
}

// Dry friction holds an error up to τ_c / (J kp), of which (1 − s) is left and what the smoothing
// takes: a joint that would stick goes where it should.
TEST(SwingFrictionTest, MovesAJointThatDryFrictionWouldHold) {
  JointWithFriction alone(TestRobot::kDyros, 0), helped(TestRobot::kDyros, kShare);
  constexpr double kStiffness = JointWithFriction::kInertia * JointWithFriction::kKp;
  const double held = alone.motor().coulomb_friction / kStiffness;
  const double start = 0.9 * held;
  EXPECT_EQ(alone.Error(start, 0, 2), start);
  EXPECT_LT(std::abs(helped.Error(start, 0, 2)), (1 - kShare) * held);
}

TEST(SwingFrictionTest, IsOddIncreasingAndAtMostTheFilesFriction) {
  robot::MotorModel motor;
  motor.coulomb_friction = 2;
  motor.static_friction = 3;
  motor.viscous_friction = 0.5;
  double before = -std::numeric_limits<double>::infinity();
  for (double v = -4; v <= 4; v += 1e-3) {
    const double torque = FrictionTorque(motor, v);
    EXPECT_EQ(torque, -FrictionTorque(motor, -v));
    EXPECT_GT(torque, before);
    EXPECT_LE(std::abs(torque), 2 + 0.5 * std::abs(v));
    before = torque;
  }
  EXPECT_EQ(FrictionTorque(motor, 0), 0);
  EXPECT_NEAR(FrictionTorque(motor, 1), 2.5, 1e-12);
}

// Through lift-off, touch-down and jumps of the load no tick changes the torque by more than the
// steepest part of the ramp does; with the load on the foot nothing is left.
TEST(SwingFrictionTest, ComesAndGoesWithoutAStep) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kMantis);
  SwingFriction friction(Config(kShare), model, kPeriod);
  const Eigen::VectorXd velocity = Eigen::VectorXd::Constant(model.num_joints(), 0.6);
  const Eigen::VectorXd acceleration = Eigen::VectorXd::Constant(model.num_joints(), -3);
  const auto count = static_cast<size_t>(model.num_joints());
  std::vector<double> before(count, 0.0);
  constexpr double kRamp = 0.05;          // s
  constexpr double kSteepest = 15.0 / 8;  // of 10 s³ − 15 s⁴ + 6 s⁵, at its middle
  double most = 0;
  for (int tick = 0; tick < 300; ++tick) {
    // Both feet; the left one up, down within the ramp, up for long; both, the load at once.
    const bool left_stands = tick < 10 || (tick >= 20 && tick < 28) || tick >= 200;
    friction.Ramp({true, left_stands}, false, left_stands ? 0.5 : 1);
    std::vector<double> torque(count, 0.0);
    friction.Add(velocity, acceleration, torque);
    for (size_t j = 0; j < count; ++j) {
      const double whole = kShare * FrictionTorque(model.motors()[j], 0.6 - kLead * 3);
      EXPECT_LE(std::abs(torque[j] - before[j]), kSteepest * kPeriod / kRamp * whole + 1e-12);
      most = std::max(most, torque[j]);
    }
    if (tick < 10 || tick >= 226) {
      EXPECT_FALSE(friction.acts());
      EXPECT_EQ(torque, std::vector<double>(count, 0.0));
    }
    before = torque;
  }
  EXPECT_GT(most, 0);
}

// The foot that a load is moved from gets the more the less it carries, the other one nothing.
TEST(SwingFrictionTest, ComesAsTheLoadGoes) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kMantis);
  const Eigen::VectorXd velocity = Eigen::VectorXd::Ones(model.num_joints());
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(model.num_joints());
  const auto count = static_cast<size_t>(model.num_joints());
  for (const robot::Foot light : robot::kFeet) {
    SwingFriction friction(Config(kShare), model, kPeriod);
    const auto at = static_cast<size_t>(AnkleOf(model, light));
    const auto loaded = static_cast<size_t>(AnkleOf(model, Other(light)));
    // A foot that a push unloads, off any ramp, is left to its friction.
    friction.Ramp({true, true}, false, light == robot::Foot::kRight ? 0 : 1);
    EXPECT_FALSE(friction.acts());
    double before = 0;
    for (double share = 0.5; share > -0.1; share -= 0.1) {
      const double eta = light == robot::Foot::kRight ? share : 1 - share;
      for (int tick = 0; tick < 100; ++tick) friction.Ramp({true, true}, true, eta);
      std::vector<double> torque(count, 0.0);
      friction.Add(velocity, rest, torque);
      EXPECT_GE(torque[at], before);
      EXPECT_EQ(torque[loaded], 0);
      before = torque[at];
    }
    EXPECT_NEAR(before, kShare * FrictionTorque(model.motors()[at], 1), 1e-9);
  }
}

// The chain's command has it beside what it is without, in the swinging leg alone, at the velocity
// that the torque of (53) leads to by the square route; computed wrenches and the drives' plan do
// not change.
TEST(SwingFrictionTest, IsAddedBehindTheCommandOfTheSwingingLeg) {
  std::mt19937 random{TestSeed(37)};
  for (const TestRobot robot : {TestRobot::kDyros, TestRobot::kMantis}) {
    const auto chain = [&](const char* extra) {
      return Chain(robot, "phase { support: RIGHT }", MonitorConfig(false),
                   RedistributorText(std::string("impedance { enabled: true } ") + extra));
    };
    Chain plain = chain(""), helped = chain("friction_compensation { share: 0.8 }");
    const robot::RobotModel& model = plain.model();
    const robot::RobotState state = Disturbed(StandingState(model), 0.03, 0.2, &random);
    for (int tick = 0; tick < 40; ++tick) {
      plain.Run(state, tick);
      helped.Run(state, tick);
    }
    const joint_command_t& without = plain.Run(state, 40);
    const joint_command_t& with = helped.Run(state, 40);
    ASSERT_EQ(with.status, joint_command_t::STATUS_OK);
    EXPECT_EQ(with.position, without.position);
    EXPECT_EQ(with.velocity, without.velocity);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(with.foot_wrench[0].force[i], without.foot_wrench[0].force[i]);
      EXPECT_EQ(with.foot_wrench[0].moment[i], without.foot_wrench[0].moment[i]);
    }
    Eigen::VectorXd q, wrench;
    Dynamics(model, state, {true, false}).Forward(ToEigen(without.torque), &q, &wrench);
    const auto leg = model.supporting_joints(model.feet()[robot::Foot::kLeft].body);
    double most = 0;
    for (int j = 0; j < model.num_joints(); ++j) {
      const auto i = static_cast<size_t>(j);
      const double added = with.torque[i] - without.torque[i];
      if (std::ranges::find(leg, j) == leg.end()) {
        EXPECT_EQ(added, 0) << model.joints()[i].name;
        continue;
      }
      const double asked = state.joint_velocity[j] + kLead * q[6 + j];
      EXPECT_NEAR(added, kShare * FrictionTorque(model.motors()[i], asked), 1e-6);
      most = std::max(most, std::abs(added));
    }
    if (robot == TestRobot::kDyros) {
      EXPECT_GT(most, 0.1);
    }
  }
}

TEST(SwingFrictionTest, RefusesWhatIsNoShareOrTime) {
  for (const char* value : {"share: -0.1", "share: 1.1", "share: nan", "lead: -1"}) {
    const std::string text = value;
    EXPECT_EQ(RefusedField(fmt::format("friction_compensation {{ {} }}", text)),
              "friction_compensation." + text.substr(0, text.find(':')));
  }
  EXPECT_EQ(RefusedField("friction_compensation { share: 1 lead: 0 }"), "accepted");
}

}  // namespace
}  // namespace poise
