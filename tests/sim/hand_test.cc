// A hand's spring, alone and on the simulated robot.
#include "sim/hand.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using Eigen::Vector3d;

HandSpring MakeHand(const std::string& text) {
  Hand config;
  ParseTextProto(text, "test", &config);
  return HandSpring(config, PaperRobot(), 1e-3, "hand[0]");
}

constexpr char kReach[] = "start: 1 move_duration: 2 release: 5 x: 0.1 y: -0.04 stiffness: 800 ";

TEST(Hand, PullsTowardsAMovingTarget) {
  HandSpring hand = MakeHand(std::string(kReach) + "damping: 30");
  const Vector3d place(0.5, 0.2, 1), offset(0.1, -0.04, 0);
  EXPECT_TRUE(hand.Force(0.5, place, Vector3d::Zero()).isZero(0));
  hand.Grip(0.5, Vector3d(9, 9, 9));  // too early: no grip
  hand.Grip(1, place);
  hand.Grip(1.5, Vector3d(9, 9, 9));  // gripped already
  EXPECT_TRUE(hand.Force(1, place, Vector3d::Zero()).isZero(1e-12));
  // Minimum jerk: half of the way at half of the time, with 15/8 of the mean speed.
  const Vector3d mid = hand.Force(2, place, Vector3d::Zero());
  EXPECT_TRUE(mid.isApprox(800 * offset / 2 + 30 * 15.0 / 8 * offset / 2, 1e-12));
  EXPECT_TRUE(hand.Force(2, place + offset / 2, 15.0 / 16 * offset).isZero(1e-12));
  for (const double time : {3.0, 4.0, 4.99}) {
    EXPECT_TRUE(hand.Force(time, place, Vector3d::Zero()).isApprox(800 * offset, 1e-12));
  }
  EXPECT_TRUE(hand.Force(5, place, Vector3d::Zero()).isZero(0)) << "let go";
}

TEST(Hand, TargetMovesWithMinimumJerk) {
  HandSpring hand = MakeHand(std::string(kReach) + "damping: 0 max_force: 1e6");
  hand.Grip(1, Vector3d::Zero());
  const double h = 1e-2;
  const auto path = [&](double time) {
    return hand.Force(time, Vector3d::Zero(), Vector3d::Zero()).x() / 80;
  };
  // The sixth derivative of the minimum jerk's path is nil; velocity and acceleration at its ends
  // too.
  const double t = 1.7;
  const double sixth = path(t - 3 * h) - 6 * path(t - 2 * h) + 15 * path(t - h) - 20 * path(t) +
                       15 * path(t + h) - 6 * path(t + 2 * h) + path(t + 3 * h);
  EXPECT_NEAR(sixth, 0, 1e-14);
  EXPECT_LT(path(1 + h), 10 * std::pow(h / 2, 3) * 1.01);
  EXPECT_LT(1 - path(3 - h), 10 * std::pow(h / 2, 3) * 1.01);
}

TEST(Hand, ForceIsLimited) {
  HandSpring hand = MakeHand(std::string(kReach) + "max_force: 20");
  hand.Grip(1, Vector3d::Zero());
  const Vector3d force = hand.Force(4, Vector3d::Zero(), Vector3d::Zero());
  EXPECT_NEAR(force.norm(), 20, 1e-12);
  EXPECT_NEAR(force.y() / force.x(), -0.4, 1e-12);
}

// The robot hangs from a hand: its weight stretches the spring by m g / k, straight below.
TEST(Hand, CarriesTheRobot) {
  const robot::RobotModel model = RigidRobot();
  const EngineSimulation probe(model, StandingConfig(), kTick, 1);
  const Vector3d com = probe.truth().com - probe.truth().state.base_position;
  SimConfig config = StandingConfig("fall_height: 0");
  Hand* hand = config.add_hand();
  ParseTextProto(
      "start: 0.1 move_duration: 1 release: 100 z: 0.2 stiffness: 20000 "
      "damping: 1500 max_force: 1e5",
      "test", hand);
  hand->mutable_point()->set_x(com.x());
  hand->mutable_point()->set_y(com.y());
  hand->mutable_point()->set_z(com.z() + 0.3);
  EngineSimulation simulation(model, config, kTick, 1);
  Vector3d grip;
  for (int i = 0; i < 20000; ++i) {
    if (i == 50) grip = simulation.truth().push_point;
    simulation.Advance();
    if (i == 40) {
      EXPECT_TRUE(simulation.truth().push_force.isZero(0));
    }
  }
  const double weight = model.total_mass() * robot::kGravity;
  EXPECT_EQ(simulation.truth().contact_points[0] + simulation.truth().contact_points[1], 0);
  EXPECT_LT((simulation.truth().push_force - Vector3d(0, 0, weight)).norm(), 1e-3 * weight);
  const Vector3d hung = grip + Vector3d(0, 0, 0.2 - weight / 20000);
  EXPECT_LT((simulation.truth().push_point - hung).norm(), 1e-4);
}

TEST(Hand, ItsForceAddsToThePushes) {
  EngineSimulation simulation(
      RigidRobot(),
      StandingConfig("push { start: 0 duration: 1 peak: 10 direction_x: 1 profile: RECTANGLE } "
                     "hand { start: 0 move_duration: 0.1 release: 1 y: 0.02 stiffness: 2000 }"),
      kTick, 1);
  for (int i = 0; i < 100; ++i) simulation.Advance();
  EXPECT_NEAR(simulation.truth().push_force.x(), 10, 1);
  EXPECT_NEAR(simulation.truth().push_force.y(), 40, 1);
}

}  // namespace
}  // namespace poise
