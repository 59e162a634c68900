// Walking on ground as it is known.
#include "components/step_planner/stepping/walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "tests/components/step_planner/walk_world.h"

namespace poise::stepping {
namespace {

TEST(Walk, StandsUntilItIsTold) {
  World world(TestRobot::kDyros);
  world.Run(1, kStand);
  EXPECT_FALSE(world.walk().active());
}

TEST(Walk, TenStepsAheadAndAStopSideBySide) {
  World world(TestRobot::kDyros);
  world.Run(11, {{0.1, 0}, 0, true});
  EXPECT_GE(world.walk().num_steps(), 9);
  world.Run(6, kStand);
  EXPECT_FALSE(world.walk().active());
  const Vector3d apart = world.sole()[1].translation() - world.sole()[0].translation();
  EXPECT_NEAR(apart.x(), 0, 0.005);
  EXPECT_GT(apart.y(), 0.15);
  EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02);
  EXPECT_GT(world.middle().x(), 0.8);
  // No jump of the centre of pressure beyond what a tick of the fastest ramp moves it.
  EXPECT_LT(world.largest_jump(), 0.012);
}

// The COM's height begins to move by the time of one tick, however long another planner had the
// feet.
TEST(Walk, BeginsAfterARecoveryAsAfterATick) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.1, 0}, 0, true};
  world.Run(kPeriod, kStand);
  world.Recover(1);
  world.Run(kPeriod, command);
  ASSERT_EQ(world.walk().stage(), WalkStage::kStarting);
  const PointMotion& com = world.walk().output().com;
  EXPECT_LT(com.acceleration.z(), -0.1);
  EXPECT_NEAR(com.velocity.z(), kPeriod * com.acceleration.z(), 1e-9);
}

// Another planner takes over in mid-walk, while the COM is lower than when standing.
TEST(Walk, GoesAsHighAfterARecoveryAsBefore) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.1, 0}, 0, true};
  const double standing = world.com().z();
  world.Run(6, command);
  ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
  const double before = world.com().z();
  EXPECT_NEAR(standing - before, 0.02, 0.002);  // com_lowering
  world.Recover(0.5);
  world.Run(6, command);
  ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
  EXPECT_NEAR(world.com().z(), before, 0.002);
}

TEST(Walk, StandsApartWhereItIsToldTo) {
  WalkConfig config;
  config.set_stand_apart(true);
  World world(TestRobot::kDyros, 0, 0, config);
  const WalkCommand command{{0.1, 0}, 0, true};
  world.Run(8, command);
  ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
  const int steps = world.walk().num_steps();
  world.Run(6, kStand);
  EXPECT_FALSE(world.walk().active());
  EXPECT_EQ(world.walk().num_steps(), steps + 1);  // the one that was under way
  const Vector3d apart = world.sole()[1].translation() - world.sole()[0].translation();
  EXPECT_NEAR(std::abs(apart.x()), 0.1, 0.01);
  EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02);
  // And walks on from there.
  world.Run(6, command);
  EXPECT_GT(world.walk().num_steps(), steps + 4);
}

TEST(Walk, KeepsToTheCommandedVelocity) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.15, 0}, 0, true};
  world.Run(6, command);
  const Vector2d from = world.middle();
  world.Run(20, command);
  EXPECT_NEAR((world.middle() - from).x() / 20, 0.15, 0.015);
  EXPECT_NEAR((world.middle() - from).y(), 0, 0.01);
}

TEST(Walk, TurnsAndStepsAside) {
  World world(TestRobot::kDyros);
  world.Run(10, {{0, 0}, 0.1, true});
  world.Run(5, kStand);
  EXPECT_FALSE(world.walk().active());
  EXPECT_GT(world.yaw(), 0.5);
  EXPECT_NEAR(Yaw(world.sole()[0]), Yaw(world.sole()[1]), 0.01);
  EXPECT_NEAR(world.walk().body_yaw().position, world.yaw(), 0.02);
  World aside(TestRobot::kDyros);
  aside.Run(10, {{0, -0.05}, 0, true});
  aside.Run(5, kStand);
  EXPECT_FALSE(aside.walk().active());
  EXPECT_LT(aside.middle().y(), -0.25);
}

TEST(Walk, StandsWhereTheFeetDoNotComeSideBySide) {
  // No last step is the last one where the ground turns each foot as it lands.
  World world(TestRobot::kDyros, 0, 0.5, QuasiStatic());
  world.Twist(0.1);
  world.Run(6, {{0, 0}, 0, true});
  const int steps = world.walk().num_steps();
  world.Run(20, kStand);
  EXPECT_GT(std::abs(Yaw(world.sole()[1]) - Yaw(world.sole()[0])), 0.15);
  EXPECT_FALSE(world.walk().active());
  EXPECT_LE(world.walk().num_steps() - steps, 4);
}

TEST(Walk, APushIsCaughtByTheNextFoothold) {
  // More than the centre of pressure within the sole brings back, on the side of the foot in the
  // air.
  for (const Vector2d& push : {Vector2d(0.25, 0), Vector2d(-0.25, 0), Vector2d(0, 0.12)}) {
    World world(TestRobot::kDyros);
    const WalkCommand command{{0, 0}, 0, true};
    world.Run(3, command);
    while (world.walk().stage() != WalkStage::kSwinging ||
           world.walk().stepping_foot() != Foot::kLeft) {
      world.Run(kPeriod, command);
    }
    world.Run(0.1, command);
    world.Push(push);
    world.Run(8, command);
    world.Run(6, kStand);
    EXPECT_FALSE(world.walk().active()) << push.transpose();
    EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02) << push.transpose();
  }
}

TEST(Walk, GoesOnWhereTheGroundIsLower) {
  // With time to take the load over, the capture point stays above the sole that carries: the other
  // foot may come down late.
  for (const auto& [rough, patient] : {std::pair(0.005, 0.0), std::pair(0.04, 0.5)}) {
    World world(TestRobot::kDyros, rough, patient);
    world.Run(30, {{0.05, 0}, 0, true});
    EXPECT_GE(world.walk().num_steps(), 12);
    world.Run(10, kStand);
    EXPECT_FALSE(world.walk().active());
  }
}

}  // namespace
}  // namespace poise::stepping
