// Walking on ground that is not known: late feet and soft soles.
#include "components/step_planner/stepping/quasi_static_walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "components/balance/minimum_jerk.h"
#include "tests/components/step_planner/walk_world.h"

namespace poise::stepping {
namespace {

TEST(QuasiStaticWalk, StandsUntilItIsTold) {
  World world(TestRobot::kDyros);
  world.Run(1, kStand);
  EXPECT_FALSE(world.walk().active());
}

TEST(QuasiStaticWalk, TenStepsAheadAndAStop) {
  World world(TestRobot::kDyros);
  world.Run(32, {{0.05, 0}, 0, true});
  EXPECT_GE(world.walk().num_landed(), 9);
  world.Run(6, kStand);
  EXPECT_FALSE(world.walk().active());
  EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02);
  EXPECT_GT(world.middle().x(), 0.8);
  // No jump of the centre of pressure beyond what a tick of the fastest ramp moves it.
  EXPECT_LT(world.largest_jump(), 0.012);
}

// The COM's height begins to move by the time of one tick, however long another planner had the
// feet.
TEST(QuasiStaticWalk, BeginsAfterARecoveryAsAfterATick) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.1, 0}, 0, true};
  world.Run(kPeriod, kStand);
  world.Recover(1);
  world.Run(kPeriod, command);
  ASSERT_EQ(world.walk().stage(), Stage::kShifting);
  const PointMotion& com = world.walk().output().com;
  EXPECT_LT(com.acceleration.z(), -0.1);
  EXPECT_NEAR(com.velocity.z(), kPeriod * com.acceleration.z(), 1e-9);
}

// Another planner takes over in mid-walk, while the COM is lower than when standing.
TEST(QuasiStaticWalk, GoesAsHighAfterARecoveryAsBefore) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.05, 0}, 0, true};
  const double standing = world.com().z();
  world.Run(12, command);
  ASSERT_TRUE(world.RunTo(Stage::kLoading, command));
  const double before = world.com().z();
  EXPECT_NEAR(standing - before, world.spec().com_lowering, 0.002);
  world.Recover(0.5);
  world.Run(12, command);
  ASSERT_TRUE(world.RunTo(Stage::kLoading, command));
  EXPECT_NEAR(world.com().z(), before, 0.002);
}

TEST(QuasiStaticWalk, StandsAsItsFeetAre) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.05, 0}, 0, true};
  world.Run(12, command);
  ASSERT_TRUE(world.RunTo(Stage::kSwinging, command));
  const int steps = world.walk().num_landed();
  world.Run(8, kStand);
  EXPECT_FALSE(world.walk().active());
  EXPECT_EQ(world.walk().num_landed(), steps + 1);  // the one that was under way
  const Vector3d apart = world.sole()[1].translation() - world.sole()[0].translation();
  EXPECT_NEAR(std::abs(apart.x()), 0.05 * world.spec().period(), 0.01);
  EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02);
  // And walks on from there.
  world.Run(16, command);
  EXPECT_GT(world.walk().num_landed(), steps + 4);
}

TEST(QuasiStaticWalk, KeepsToTheCommandedVelocity) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.05, 0}, 0, true};
  world.Run(12, command);
  const Vector2d from = world.middle();
  const double duration = 10 * world.spec().period();
  world.Run(duration, command);
  EXPECT_NEAR((world.middle() - from).x() / duration, 0.05, 0.005);
  EXPECT_NEAR((world.middle() - from).y(), 0, 0.01);
}

TEST(QuasiStaticWalk, TurnsAndStepsAside) {
  World world(TestRobot::kDyros);
  world.Run(20, {{0, 0}, 0.05, true});
  world.Run(5, kStand);
  EXPECT_FALSE(world.walk().active());
  EXPECT_GT(world.yaw(), 0.5);
  EXPECT_NEAR(world.walk().body_yaw().position, world.yaw(), 0.02);
  World aside(TestRobot::kDyros);
  aside.Run(20, {{0, -0.02}, 0, true});
  aside.Run(5, kStand);
  EXPECT_FALSE(aside.walk().active());
  EXPECT_LT(aside.middle().y(), -0.25);
}

TEST(QuasiStaticWalk, RestsAboveTheSoleThatCarriesHoweverLateTheOtherComesDown) {
  // The ground is 55 mm lower under every third foothold: half a second late at 0.1 m/s.
  World world(TestRobot::kDyros, 0.055);
  const WalkCommand command{{0.05, 0}, 0, true};
  bool rested = false;
  for (int i = 0; i < 20000; ++i) {
    world.Run(kPeriod, command);
    const QuasiStaticWalk& walk = world.walk();
    if (walk.stage() != Stage::kTouching) continue;
    const auto stance = robot::Index(Other(walk.stepping_foot()));
    const Vector2d off = world.capture_point() - world.sole()[stance].translation().head<2>();
    EXPECT_LT(off.norm(), 0.02) << i;
    rested = true;
  }
  EXPECT_TRUE(rested);
  EXPECT_GE(world.walk().num_landed(), 12);
  world.Run(15, kStand);
  EXPECT_FALSE(world.walk().active());
}

TEST(QuasiStaticWalk, LoadLeavesAFootNoSoonerThanTheCentreOfPressure) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.05, 0}, 0, true};
  double most = 0;
  int seen = 0;
  for (int i = 0; i < 10000; ++i) {
    world.Run(kPeriod, command);
    const QuasiStaticWalk& walk = world.walk();
    if (walk.stage() != Stage::kUnloading || walk.num_landed() == 0) continue;
    const auto leaves = robot::Index(walk.stepping_foot());
    const Vector2d other = world.sole()[1 - leaves].translation().head<2>();
    const Vector2d way = world.sole()[leaves].translation().head<2>() - other;
    // As much as lies below the centre of pressure, were each sole's own in its middle.
    const double natural = (walk.output().cop - other).dot(way) / way.squaredNorm();
    const double left = std::max(natural, 0.0);
    const double carries = left * (1 - balance::SmoothStep(walk.output().progress));
    most = std::max(most, (left - carries) * way.norm());
    ++seen;
  }
  EXPECT_GT(seen, 1000);
  EXPECT_GT(most, 0.5 * world.spec().load_lead);  // the ramp runs at all
  EXPECT_LT(most, 1.3 * world.spec().load_lead);  // a tick late, and the slowest rate
}

TEST(QuasiStaticWalk, StandsInTheMiddlesOfBothSolesWhilePressing) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0.05, 0}, 0, true};
  ASSERT_TRUE(world.RunTo(Stage::kTouching, command));
  // The stance keeps nine tenths of the weight, the other sole takes one.
  ASSERT_TRUE(world.RunTo(Stage::kLoading, command));
  world.Run(0.1, command);
  const auto landed = robot::Index(Other(world.walk().stepping_foot()));
  const Vector2d stance = world.sole()[1 - landed].translation().head<2>();
  const Vector2d way = world.sole()[landed].translation().head<2>() - stance;
  const double share = (world.walk().wanted() - stance).dot(way) / way.squaredNorm();
  EXPECT_GT(share, 0.02);
  EXPECT_LT(share, 0.1);
}

TEST(QuasiStaticWalk, GoesDownAndWaitsAsThePressLetsExpect) {
  for (const double depth : {0.0, 0.04}) {
    World world(TestRobot::kDyros);
    const WalkCommand command{{0, 0}, 0, true};
    world.Soften(depth);
    ASSERT_TRUE(world.RunTo(Stage::kTouching, command));
    const double height = world.com().z();  // the COM goes down with the foot that is pressed
    ASSERT_TRUE(world.RunTo(Stage::kLoading, command));
    world.Soften(0);
    const double start = world.time();
    ASSERT_TRUE(world.RunTo(Stage::kSwinging, command));
    // A spring that 200 of 500 N press by `depth` goes down by 2.5 times that under all of them.
    const double whole = depth * kWeight / kDownLoad;
    EXPECT_GE(world.time() - start, std::max(whole / QuasiStaticWalk::kSinkSpeed, 1.6) - 0.01)
        << depth;
    EXPECT_LT(world.time() - start, std::max(whole / QuasiStaticWalk::kSinkSpeed, 1.6) + 1.0)
        << depth;
    // The foot stands `depth` lower; three fifths of the load are still to come, of which
    // most_ahead counts. Above a sole that sinks the COM comes up as its leg reaches, 0.92 of a
    // straight one, as high as it stands at most.
    const QuasiStaticWalk& walk = world.walk();
    const Foot foot = Other(walk.stepping_foot());
    const double stands = walk.choice().legs().height();
    const Vector2d sole =
        world.sole()[robot::Index(foot)].translation().head<2>() - world.com().head<2>();
    const double leg = walk.choice().legs().Highest(foot, sole, 0.92);
    const double ahead = std::min(0.6 * whole, world.spec().most_ahead);
    const double up =
        whole > world.spec().soft
            ? std::max(std::min(leg, stands) - stands + world.spec().com_lowering, 0.0)
            : 0;
    EXPECT_NEAR(height - world.com().z(), depth + ahead - up, 0.005) << depth;
  }
}

// Where a sole has sunk the other foot looks for the ground where that sole met it, and as deep
// below where it stands as else.
TEST(QuasiStaticWalk, LooksForTheGroundWhereTheSunkSoleMetIt) {
  const WalkCommand command{{0.05, 0}, 0, true};
  constexpr double kSunk = 0.05;
  for (const bool hole : {false, true}) {
    World world(TestRobot::kDyros);
    world.Soften(kSunk);
    ASSERT_TRUE(world.RunTo(Stage::kLoading, command));
    world.Soften(0);
    ASSERT_TRUE(world.RunTo(Stage::kSwinging, command));
    const double due = world.walk().steps().first().touch_down;
    if (hole) world.Dig(-1, 1);
    if (!hole) {
      ASSERT_TRUE(world.RunTo(Stage::kTouching, command));
      EXPECT_NEAR(world.time(), due, 0.02);
    } else {
      world.Run(6, command);
      EXPECT_NEAR(world.walk().output().swing.position.z(),
                  -kSunk - world.spec().landing.search_depth, 1e-3);
      EXPECT_EQ(world.walk().output().foot_state, Landing::State::kSearching);
    }
  }
}

// A phase's control of the COM stirred soles on soft ground: the robot fell as it stopped.
TEST(QuasiStaticWalk, KeepsARobotThatStopsOnSoftGround) {
  const WalkCommand command{{0, 0}, 0, true};
  for (const double depth : {0.0, 0.04}) {
    World world(TestRobot::kDyros);
    world.Soften(depth);
    world.Run(12, command);
    ASSERT_TRUE(world.RunTo(Stage::kSwinging, command));
    world.Run(20, kStand);
    EXPECT_EQ(world.walk().active(), depth > 0);
    EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02) << depth;
    const int steps = world.walk().num_landed();
    world.Run(5, kStand);
    EXPECT_EQ(world.walk().num_landed(), steps) << depth;
    world.Run(12, command);
    EXPECT_GT(world.walk().num_landed(), steps) << depth;
  }
}

TEST(QuasiStaticWalk, TheArchiveIsAllOfItsState) {
  // A turn, a sole that sinks and a stop.
  {
    const World start(TestRobot::kDyros);
    std::vector<World> worlds(2, start);
    worlds[1].Hand(worlds[1].walk());
    for (int tick = 0; tick < 12000; ++tick) {
      for (World& world : worlds) {
        if (tick == 0) world.Soften(0.02);
        world.Run(kPeriod, tick < 8000 ? WalkCommand{{0.05, 0}, 0.05, true} : kStand);
      }
      for (size_t foot = 0; foot < 2; ++foot) {
        ASSERT_EQ(worlds[0].sole()[foot].matrix(), worlds[1].sole()[foot].matrix()) << tick;
      }
      ASSERT_EQ(worlds[0].com(), worlds[1].com()) << tick;
      ASSERT_EQ(worlds[0].walk().output().cop, worlds[1].walk().output().cop) << tick;
    }
    EXPECT_GE(worlds[0].walk().num_landed(), 4);
  }
}

TEST(QuasiStaticWalk, AFootThatFindsNothingWaitsWhereItIs) {
  World world(TestRobot::kDyros);
  world.Dig(0.02, 1);
  const WalkCommand command{{0.05, 0}, 0, true};
  ASSERT_TRUE(world.RunTo(Stage::kSwinging, command));
  const auto stance = robot::Index(Other(world.walk().stepping_foot()));
  for (int i = 0; i < 5000; ++i) {
    world.Run(kPeriod, command);
    const Vector2d off = world.capture_point() - world.sole()[stance].translation().head<2>();
    EXPECT_LT(off.norm(), 0.02) << i;
  }
  EXPECT_EQ(world.walk().num_landed(), 0);
}

// Soles that sink by 2.5 and 7 times what counts as soft: the swing takes the root of it longer,
// at most 2.5 times.
TEST(QuasiStaticWalk, SwingsSlowlyAboveASoleThatHasSunk) {
  const WalkCommand command{{0, 0}, 0, true};
  for (const double times : {0.0, 2.5, 7.0}) {
    World world(TestRobot::kDyros);
    const double sinks = times * world.spec().soft;
    ASSERT_TRUE(world.RunTo(Stage::kTouching, command));
    world.Soften(sinks * kDownLoad / kWeight);
    ASSERT_TRUE(world.RunTo(Stage::kLoading, command));
    world.Soften(0);
    ASSERT_TRUE(world.RunTo(Stage::kSwinging, command));
    const double due = world.walk().steps().first().touch_down - world.time();
    EXPECT_NEAR(due / world.spec().swing, std::clamp(std::sqrt(times), 1.0, 2.5), 0.02) << times;
  }
}

TEST(QuasiStaticWalk, IsLostOnceTheCapturePointHasLeftTheSoleThatCarries) {
  World world(TestRobot::kDyros);
  const WalkCommand command{{0, 0}, 0, true};
  EXPECT_FALSE(world.Lost({1, 0}));  // it stands
  while (world.walk().stage() != Stage::kSwinging) world.Run(kPeriod, command);
  world.Run(0.2, command);
  // The sole is 0.3 m long and 0.15 m wide; a velocity v moves the capture point by v sqrt(z/g).
  const double time = std::sqrt(world.com().z() / robot::kGravity);
  EXPECT_FALSE(world.Lost({0, 0}));
  EXPECT_FALSE(world.Lost({0.12 / time, 0}));
  EXPECT_TRUE(world.Lost({0.18 / time, 0}));
  EXPECT_FALSE(world.Lost({0, 0.05 / time}));
  EXPECT_TRUE(world.Lost({0, 0.1 / time}));
}

}  // namespace
}  // namespace poise::stepping
