// The crane's spring: in closed form, alone and on the simulated robot.
#include "sim/crane.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "components/framework/configuration/field_rules.h"
#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kStep = 1e-3;   // s
constexpr int64_t kLead = 1000;  // ticks

CraneSpring MakeCrane(const std::string& text) {
  Crane config;
  ParseTextProto(text, "test", &config);
  CheckFields(config, "crane.");
  return CraneSpring(config, PaperRobot(), Isometry3d::Identity(), Vector3d(0.02, 0, 0.7), kStep,
                     kTick);
}

void Follow(CraneSpring* crane, bool follows, double seconds) {
  for (int i = 0; i < std::lround(seconds / kTick); ++i) crane->Follow(follows);
}

TEST(Crane, HangsAboveTheComByASpringOfTheRobotsWeight) {
  const CraneSpring crane = MakeCrane("height: 0.25");
  EXPECT_TRUE(crane.anchor().isApprox(Vector3d(0.02, 0, 0.95)));
  EXPECT_TRUE(crane.point().isApprox(crane.anchor()));
  const double weight = PaperRobot().total_mass() * robot::kGravity;
  EXPECT_NEAR(crane.stiffness(), weight / 0.01, 1e-6);
  EXPECT_NEAR(crane.Force(crane.anchor() - 0.01 * Vector3d::UnitZ(), Vector3d::Zero()).z(), weight,
              1e-9);
  const Vector3d velocity(0.3, -0.1, 0.2);
  EXPECT_TRUE(crane.Force(crane.anchor(), velocity).isApprox(-crane.damping() * velocity, 1e-12));
  EXPECT_EQ(MakeCrane("stiffness: 5e4 damping: 900").stiffness(), 5e4);
  EXPECT_EQ(MakeCrane("stiffness: 5e4 damping: 900").damping(), 900);
}

TEST(Crane, LetsGoSmoothlyOnceTheBridgeHasFollowed) {
  CraneSpring crane = MakeCrane("follow_time: 0.2 release_time: 0.5");
  Follow(&crane, false, 5);
  EXPECT_EQ(crane.share(), 1);
  Follow(&crane, true, 0.198);
  EXPECT_EQ(crane.share(), 1);
  Follow(&crane, false, kTick);  // from the beginning again
  Follow(&crane, true, 0.2);
  EXPECT_EQ(crane.share(), 1);
  Follow(&crane, true, 0.25);  // half of the way: minimum jerk is half there
  EXPECT_NEAR(crane.share(), 0.5, 0.01);
  double before = crane.share();
  for (int i = 0; i < 130; ++i) {
    crane.Follow(true);
    EXPECT_LE(crane.share(), before);
    EXPECT_LT(before - crane.share(), 15.0 / 8 * kTick / 0.5 + 1e-9);  // its greatest speed
    before = crane.share();
  }
  EXPECT_TRUE(crane.let_go());
  EXPECT_EQ(crane.share(), 0);
  EXPECT_TRUE(crane.Force(Vector3d::Zero(), Vector3d::Ones()).isZero(0));
  Follow(&crane, false, 1);  // for good
  EXPECT_EQ(crane.share(), 0);
}

TEST(Crane, TakesHoldAgainWhenTheBridgeStopsFollowingMeanwhile) {
  CraneSpring crane = MakeCrane("follow_time: 0.1 release_time: 1");
  Follow(&crane, true, 0.8);
  EXPECT_LT(crane.share(), 0.25);
  EXPECT_FALSE(crane.let_go());
  Follow(&crane, false, 0.1);
  EXPECT_EQ(crane.share(), 1);
  Follow(&crane, true, 1.15);
  EXPECT_TRUE(crane.let_go());
}

TEST(Crane, RefusesWhatCannotWork) {
  const auto field = [](const std::string& text) -> std::string {
    try {
      MakeCrane(text);
    } catch (const ConfigError& error) {
      return error.field();
    }
    return "";
  };
  EXPECT_EQ(field("height: -1"), "crane.height");
  EXPECT_EQ(field("release_time: 0"), "crane.release_time");
  EXPECT_EQ(field("follow_time: -1"), "crane.follow_time");
  EXPECT_EQ(field("stiffness: 0"), "crane.stiffness");
  EXPECT_EQ(field("damping: 1e6"), "crane.damping");
  try {
    EngineSimulation(PaperRobot(), StandingConfig("crane {}"), kTick, 1);
    FAIL() << "without a lead";
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), "crane");
  }
}

/// A rigid robot with drawn-up legs, its feet in the air, with its COM below the crane's point,
/// which is where it holds nothing yet.
class HangingRobot {
 public:
  explicit HangingRobot(const std::string& crane)
      : simulation_(RigidRobot(), StandingConfig("fall_height: 0 crane { " + crane + " }"), kTick,
                    1, kLead) {
    const robot::RobotModel& model = simulation_.model();
    robot::RobotState state = simulation_.truth().state;
    anchor_ = simulation_.truth().crane_point;
    const Vector3d point =
        state.base_orientation.inverse() * (anchor_ - state.base_position);  // base's frame
    for (const std::string side : {"right", "left"}) {
      state.joint_position[model.FindJoint(side + "_hip_pitch")] = -0.9;
      state.joint_position[model.FindJoint(side + "_knee_pitch")] = 1.8;
      state.joint_position[model.FindJoint(side + "_ankle_pitch")] = -0.9;
    }
    robot::RobotData data(model);
    state.base_position.setZero();
    state.base_orientation.setIdentity();
    robot::ComputeKinematics(model, state, &data);
    robot::ComputeFeet(model, &data);
    robot::ComputeDynamics(model, state, &data);
    state.base_orientation =
        Eigen::Quaterniond::FromTwoVectors(data.com - point, -Vector3d::UnitZ());
    state.base_position = anchor_ - state.base_orientation * point;
    simulation_.SetState(state);
  }
  Simulation& simulation() { return simulation_; }
  /// m, that the point has sunk.
  double sag() const { return anchor_.z() - simulation_.truth().crane_point.z(); }
  double aside() const { return (anchor_ - simulation_.truth().crane_point).head<2>().norm(); }

 private:
  EngineSimulation simulation_;
  Vector3d anchor_;
};

TEST(Crane, ARobotInTheAirSinksAsADampedOscillatorToWeightOverStiffness) {
  HangingRobot robot("damping: 1500");
  const double mass = robot.simulation().model().total_mass();
  const double rest = 0.01;
  const double omega = std::sqrt(robot::kGravity / rest);
  const double decay = 1500 / (2 * mass);
  ASSERT_LT(decay, omega);
  const double ringing = std::sqrt(omega * omega - decay * decay);
  for (int i = 1; i <= 300; ++i) {
    robot.simulation().Advance();
    ASSERT_EQ(robot.simulation().end_reason(), "");
    ASSERT_EQ(robot.simulation().truth().contact_points[0], 0);
    const double t = i * kTick;
    const double sag =
        rest * (1 - std::exp(-decay * t) *
                        (std::cos(ringing * t) + decay / ringing * std::sin(ringing * t)));
    // The engine and the force are of first order in the step.
    ASSERT_NEAR(robot.sag(), sag, 2 * omega * kStep * rest) << t;
  }
  EXPECT_NEAR(robot.sag(), rest, 1e-3 * rest);
  EXPECT_LT(robot.aside(), 1e-4);
  EXPECT_NEAR(robot.simulation().truth().crane_force.z(), mass * robot::kGravity,
              1e-3 * mass * robot::kGravity);
}

TEST(Crane, OnlyEverTakesEnergyFromARobotThatItHolds) {
  HangingRobot robot("");
  const Simulation& simulation = robot.simulation();
  const double mass = simulation.model().total_mass();
  const double stiffness = mass * robot::kGravity / 0.01;
  const auto energy = [&] {
    return 0.5 * mass * simulation.truth().com_velocity.squaredNorm() +
           mass * robot::kGravity * simulation.truth().com.z() +
           0.5 * stiffness * robot.sag() * robot.sag();
  };
  const double first = energy();
  double before = first;
  for (int i = 0; i < 200; ++i) {
    robot.simulation().Advance();
    EXPECT_LT(energy(), before + 1e-3);
    before = energy();
  }
  // What is left is the potential energy of the sag, half of what was lost of height.
  EXPECT_NEAR(first - before, 0.5 * mass * robot::kGravity * 0.01,
              0.02 * mass * robot::kGravity * 0.01);
}

TEST(Crane, ARobotThatIsNeverFollowedEndsTheRunWhenTheScenarioBegins) {
  EngineSimulation simulation(RigidRobot(), StandingConfig("crane {}"), kTick, 1, kLead);
  EXPECT_DOUBLE_EQ(simulation.time(), -kLead * kTick);
  for (int64_t i = 0; i < kLead; ++i) {
    ASSERT_EQ(simulation.end_reason(), "") << i;
    simulation.Follow(false);
    simulation.Advance();
  }
  EXPECT_FALSE(simulation.fallen());
  EXPECT_NE(simulation.end_reason().find("the crane still holds the robot at 0.000 s"),
            std::string_view::npos)
      << simulation.end_reason();
}

TEST(Crane, LetGoIsAsIfItHadNeverBeen) {
  SimConfig config = StandingConfig("crane { follow_time: 0 release_time: 0.002 }");
  EngineSimulation with(RigidRobot(), config, kTick, 1, kLead);
  config.clear_crane();
  EngineSimulation without(RigidRobot(), config, kTick, 1);
  with.Follow(true);
  with.Follow(true);
  EXPECT_EQ(with.truth().crane_share, 1);  // of the last reading
  with.SetState(with.truth().state);
  without.SetState(without.truth().state);
  for (int i = 0; i < 20; ++i) {
    with.Advance();
    without.Advance();
    ASSERT_EQ(with.truth().com, without.truth().com) << i;
    ASSERT_TRUE(with.truth().crane_force.isZero(0));
  }
}

}  // namespace
}  // namespace poise
