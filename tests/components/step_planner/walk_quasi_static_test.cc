// Walking on ground that is not known: late feet and soft soles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "components/balance/minimum_jerk.h"
#include "components/step_planner/stepping/walk.h"
#include "tests/components/step_planner/walk_world.h"

namespace poise::stepping {
namespace {

TEST(Walk, RestsAboveTheSoleThatCarriesHoweverLateTheOtherComesDown) {
  // The ground is 55 mm lower under every third foothold: half a second late at 0.1 m/s.
  World world(TestRobot::kDyros, 0.055, 0.5, QuasiStatic());
  const WalkCommand command{{0.05, 0}, 0, true};
  bool rested = false;
  for (int i = 0; i < 20000; ++i) {
    world.Run(kPeriod, command);
    const Walk& walk = world.walk();
    if (walk.stage() != WalkStage::kTouching) continue;
    const auto stance = robot::Index(Other(walk.stepping_foot()));
    const Vector2d off = world.capture_point() - world.sole()[stance].translation().head<2>();
    EXPECT_LT(off.norm(), 0.02) << i;
    rested = true;
  }
  EXPECT_TRUE(rested);
  EXPECT_GE(world.walk().num_steps(), 12);
  world.Run(15, kStand);
  EXPECT_FALSE(world.walk().active());
}

TEST(Walk, LoadLeavesAFootNoSoonerThanTheCentreOfPressure) {
  World world(TestRobot::kDyros, 0, 0.5, QuasiStatic());
  const WalkCommand command{{0.05, 0}, 0, true};
  double most = 0;
  int seen = 0;
  for (int i = 0; i < 10000; ++i) {
    world.Run(kPeriod, command);
    const Walk& walk = world.walk();
    if (walk.stage() != WalkStage::kUnloading || walk.num_steps() == 0) continue;
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

TEST(Walk, StandsInTheMiddlesOfBothSolesWhilePressing) {
  World world(TestRobot::kDyros, 0, 0.5, QuasiStatic());
  const WalkCommand command{{0.05, 0}, 0, true};
  ASSERT_TRUE(world.RunTo(WalkStage::kTouching, command));
  // The stance keeps nine tenths of the weight, the other sole takes one.
  ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
  world.Run(0.1, command);
  const auto landed = robot::Index(Other(world.walk().stepping_foot()));
  const Vector2d stance = world.sole()[1 - landed].translation().head<2>();
  const Vector2d way = world.sole()[landed].translation().head<2>() - stance;
  const double share = (world.walk().wanted().capture_point - stance).dot(way) / way.squaredNorm();
  EXPECT_GT(share, 0.02);
  EXPECT_LT(share, 0.1);
}

TEST(Walk, GoesDownAndWaitsAsThePressLetsExpect) {
  for (const double depth : {0.0, 0.04}) {
    World world(TestRobot::kDyros, 0, 0.5, QuasiStatic());
    const WalkCommand command{{0, 0}, 0, true};
    world.Soften(depth);
    ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
    world.Soften(0);
    const double start = world.time(), height = world.com().z();
    ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
    // A spring that 200 of 500 N press by `depth` goes down by 2.5 times that under all of them.
    const double whole = depth * kWeight / kDownLoad;
    EXPECT_GE(world.time() - start, std::max(whole / world.spec().sink_speed, 1.4) - 0.01) << depth;
    EXPECT_LT(world.time() - start, std::max(whole / world.spec().sink_speed, 1.4) + 1.0) << depth;
    // The foot stands `depth` lower; three fifths of the load are still to come, of which
    // most_ahead counts. Above a sole that sinks the COM comes up as its leg reaches, 0.92 of a
    // straight one, as high as it stands at most.
    const Walk& walk = world.walk();
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
TEST(Walk, LooksForTheGroundWhereTheSunkSoleMetIt) {
  const WalkCommand command{{0.05, 0}, 0, true};
  constexpr double kSunk = 0.05;
  for (const bool hole : {false, true}) {
    World world(TestRobot::kDyros, 0, 0.5, QuasiStatic());
    world.Soften(kSunk);
    ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
    world.Soften(0);
    ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
    const double due = world.walk().touch_down();
    if (hole) world.Dig(-1, 1);
    if (!hole) {
      ASSERT_TRUE(world.RunTo(WalkStage::kTouching, command));
      EXPECT_NEAR(world.time(), due, 0.02);
    } else {
      world.Run(3, command);
      EXPECT_NEAR(world.walk().output().swing.position.z(), -kSunk - world.spec().search_depth,
                  1e-3);
    }
  }
}

// A phase's control of the COM stirred soles on soft ground: the robot fell as it stopped.
TEST(Walk, KeepsARobotThatStopsOnSoftGround) {
  const WalkCommand command{{0, 0}, 0, true};
  for (const double depth : {0.0, 0.04}) {
    World world(TestRobot::kDyros, 0, 0.5, QuasiStatic());
    world.Soften(depth);
    world.Run(12, command);
    ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
    world.Run(20, kStand);
    EXPECT_EQ(world.walk().active(), depth > 0);
    EXPECT_NEAR((world.com().head<2>() - world.middle()).norm(), 0, 0.02) << depth;
    const int steps = world.walk().num_steps();
    world.Run(5, kStand);
    EXPECT_EQ(world.walk().num_steps(), steps) << depth;
    world.Run(12, command);
    EXPECT_GT(world.walk().num_steps(), steps) << depth;
  }
}

TEST(Walk, TheArchiveIsAllOfItsState) {
  // A turn, a sole that sinks and a stop; then a push of a walk that is not quasi-static.
  for (const bool quasi_static : {true, false}) {
    const World start(TestRobot::kDyros, 0, quasi_static ? 0.5 : 0,
                      quasi_static ? QuasiStatic() : WalkConfig());
    std::vector<World> worlds(2, start);
    worlds[1].Hand(worlds[1].walk());
    for (int tick = 0; tick < 12000; ++tick) {
      for (World& world : worlds) {
        if (tick == 0 && quasi_static) world.Soften(0.02);
        if (tick == 2000 && !quasi_static) world.Push({0.1, 0.02});
        world.Run(kPeriod, tick < 8000 ? WalkCommand{{0.05, 0}, 0.05, true} : kStand);
      }
      for (size_t foot = 0; foot < 2; ++foot) {
        ASSERT_EQ(worlds[0].sole()[foot].matrix(), worlds[1].sole()[foot].matrix()) << tick;
      }
      ASSERT_EQ(worlds[0].com(), worlds[1].com()) << tick;
      ASSERT_EQ(worlds[0].walk().output().cop, worlds[1].walk().output().cop) << tick;
    }
    EXPECT_GE(worlds[0].walk().num_steps(), 4);
  }
}

TEST(Walk, AFootThatFindsNothingWaitsWhereItIs) {
  World world(TestRobot::kDyros, 0, 0.5, QuasiStatic());
  world.Dig(0.02, 1);
  const WalkCommand command{{0.05, 0}, 0, true};
  ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
  const auto stance = robot::Index(Other(world.walk().stepping_foot()));
  for (int i = 0; i < 5000; ++i) {
    world.Run(kPeriod, command);
    const Vector2d off = world.capture_point() - world.sole()[stance].translation().head<2>();
    EXPECT_LT(off.norm(), 0.02) << i;
  }
  EXPECT_EQ(world.walk().num_steps(), 0);
}

// Soles that sink by 2.5 and 4.5 times what counts as soft: the swing takes the root of it longer,
// at most twice.
TEST(Walk, SwingsSlowlyAboveASoleThatHasSunk) {
  const WalkCommand command{{0, 0}, 0, true};
  WalkConfig config = QuasiStatic();
  config.set_slowest_swing(2);
  for (const double times : {0.0, 2.5, 4.5}) {
    World world(TestRobot::kDyros, 0, 0.5, config);
    const double sinks = times * world.spec().soft;
    ASSERT_TRUE(world.RunTo(WalkStage::kTouching, command));
    world.Soften(sinks * kDownLoad / kWeight);
    ASSERT_TRUE(world.RunTo(WalkStage::kLoading, command));
    world.Soften(0);
    ASSERT_TRUE(world.RunTo(WalkStage::kSwinging, command));
    const double due = world.walk().touch_down() - world.time();
    EXPECT_NEAR(due / world.spec().swing, std::clamp(std::sqrt(times), 1.0, 2.0), 0.02) << times;
  }
}

TEST(Walk, IsLostOnceTheCapturePointHasLeftTheSoleThatCarries) {
  World world(TestRobot::kDyros, 0, 0.5, QuasiStatic());
  const WalkCommand command{{0, 0}, 0, true};
  EXPECT_FALSE(world.Lost({1, 0}));  // it stands
  while (world.walk().stage() != WalkStage::kSwinging) world.Run(kPeriod, command);
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
