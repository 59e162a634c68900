// What a walk is made of: footsteps, the capture point of strides, edges that are told of, and how
// far a pressed sole has sunk.
#include "components/step_planner/stepping/footsteps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "components/balance/minimum_jerk.h"
#include "components/step_planner/stepping/quasi_static_walk.h"
#include "components/step_planner/stepping/sole_memory.h"
#include "components/step_planner/stepping/stride_correction.h"
#include "tests/robot/robot_test_support.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using robot::TestRobot;

FootstepLimits Limits() { return {0.21, 0.17, 0.3, 0.15, 0.4}; }

// What another planner asks for, and nothing else; clipped to what the legs allow.
TEST(Footsteps, AStrideThatIsGivenIsWalkedAsFarAsLegsReach) {
  WalkCommand command{.stepping = true, .period = 0.4};
  command.stride[Foot::kRight] = {{0.1, -0.2}, -0.1};
  command.stride[Foot::kLeft] = {{0.5, 0.1}, 1};
  const Foothold stance{{1, 2}, std::numbers::pi / 2};  // ahead is y, left is −x
  const Foothold right = NextFootstep(stance, Foot::kRight, command, 1, Limits());
  EXPECT_LT((right.position - Vector2d(1.2, 2.1)).norm(), 1e-12);
  EXPECT_NEAR(right.yaw, stance.yaw - 0.1, 1e-12);
  const Foothold left = NextFootstep(stance, Foot::kLeft, command, 1, Limits());
  EXPECT_LT((left.position - Vector2d(1 - 0.17, 2.3)).norm(), 1e-12);
  EXPECT_NEAR(left.yaw, stance.yaw + 0.4, 1e-12);
  // It is taken over at once: who plans the feet plans how fast they set off.
  EXPECT_EQ(Approach({}, command, 0, 0).stride[Foot::kRight].position.x(), 0.1);
}

// By Runge and Kutta, on one sole after the other: where a stride ends the next one begins.
TEST(Footsteps, TheCapturePointComesAgainWithEveryTwoStrides) {
  const double w = 3.7, period = 0.35;
  const int parts = 200;
  for (const Vector2d& velocity : {Vector2d(0, 0), Vector2d(0.5, 0), Vector2d(-0.3, 0),
                                   Vector2d(0, 0.2), Vector2d(0.4, -0.1)}) {
    const WalkCommand command{velocity, 0, true};
    Foothold stance{{0.3, -0.1}, 0};
    Foot foot = Foot::kLeft;
    Vector2d point =
        stance.position + NominalStride(stance, foot, command, period, w, Limits()).begin;
    for (int step = 0; step < 6; ++step) {
      const Stride stride = NominalStride(stance, foot, command, period, w, Limits());
      EXPECT_LT((point - stance.position - stride.begin).norm(), 1e-6) << step;
      for (int i = 0; i < parts; ++i) {
        const double h = period / parts;
        const auto rate = [&](const Vector2d& x) -> Vector2d { return w * (x - stance.position); };
        const Vector2d k1 = rate(point), k2 = rate(point + 0.5 * h * k1);
        const Vector2d k3 = rate(point + 0.5 * h * k2), k4 = rate(point + h * k3);
        point += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      }
      EXPECT_LT((point - stride.next.position - stride.end).norm(), 1e-6) << step;
      // Rounding grows by e^{ωT} in a step.
      point = stride.next.position + stride.end;
      stance = stride.next;
      foot = Other(foot);
    }
  }
}

TEST(Footsteps, TurningOnTheSpotComesBackToWhereItBegan) {
  // 16 pairs of steps, each a sixteenth of a turn.
  const double turn = 2 * std::numbers::pi / 16;
  for (const double sign : {1.0, -1.0}) {
    WalkCommand command{{0, 0}, sign * 0.5 * turn, true};
    Foothold stance{{0, -0.105}, 0};  // the right foot
    const Foothold first = stance;
    for (int i = 0; i < 32; ++i) {
      stance = NextFootstep(stance, i % 2 == 0 ? Foot::kLeft : Foot::kRight, command, 1, Limits());
    }
    EXPECT_NEAR(stance.yaw - first.yaw, sign * 2 * std::numbers::pi, 1e-9);
    EXPECT_LT((stance.position - first.position).norm(), 1e-9);
  }
}

TEST(Footsteps, GoesAsFastAsCommanded) {
  for (const Vector2d& velocity :
       {Vector2d(0.2, 0), Vector2d(-0.1, 0), Vector2d(0, 0.05), Vector2d(0.1, -0.05)}) {
    Foothold stance{{0, -0.105}, 0};
    for (int i = 0; i < 20; ++i) {
      stance = NextFootstep(stance, i % 2 == 0 ? Foot::kLeft : Foot::kRight, {velocity, 0, true},
                            0.8, Limits());
    }
    EXPECT_LT((stance.position - Vector2d(0, -0.105) - 16 * velocity).norm(), 1e-9)
        << velocity.transpose();
  }
}

TEST(Footsteps, FeetNeverCrossOrTurnTowardsEachOther) {
  for (const double vx : {-1.0, 0.0, 1.0}) {
    for (const double vy : {-1.0, 0.0, 1.0}) {
      for (const double wz : {-1.0, 0.0, 1.0}) {
        Foothold stance{{0, 0.105}, 0.3};  // the left foot
        for (int i = 0; i < 12; ++i) {
          const Foot foot = i % 2 == 0 ? Foot::kRight : Foot::kLeft;
          const double side = Side(foot);
          const Foothold next = NextFootstep(stance, foot, {{vx, vy}, wz, true}, 1, Limits());
          const Vector2d apart =
              Eigen::Rotation2Dd(-stance.yaw) * (next.position - stance.position);
          EXPECT_GE(side * apart.y(), Limits().least_spacing - 1e-12);
          EXPECT_GE(side * (next.yaw - stance.yaw), -1e-12);
          EXPECT_LE(std::abs(next.yaw - stance.yaw), Limits().most_turn + 1e-12);
          stance = next;
        }
      }
    }
  }
}

TEST(Footsteps, WhatALandingWasOffIsNotCarriedOn) {
  // Every landing is 10 mm beside its foothold and 5 mrad turned: the way is left by one landing's
  // error, not by the sum of 40.
  const WalkCommand command{{0.2, 0}, 0, true};
  const Vector2d error(0.004, 0.01);
  Foothold way{{0, -0.105}, 0}, stance = way, adrift = way;
  for (int i = 0; i < 40; ++i) {
    const Foot foot = i % 2 == 0 ? Foot::kLeft : Foot::kRight;
    const auto next = [&](const Foothold& from) {
      return NextFootstep(from, foot, command, 1, Limits());
    };
    stance = Towards(next(stance), next(way), 0.03, stance, foot, Limits());
    adrift = Towards(next(adrift), next(way), 0, adrift, foot, Limits());
    way = next(way);
    for (Foothold* step : {&stance, &adrift}) {
      step->position += error;
      step->yaw += 0.005;
    }
    EXPECT_NEAR((stance.position - way.position).norm(), error.norm(), 1e-12) << i;
    EXPECT_NEAR(stance.yaw - way.yaw, 0.005, 1e-12) << i;
  }
  EXPECT_GT((adrift.position - way.position).norm(), 0.4);
}

TEST(Footsteps, AWayThatIsFarIsComeBackToByStepsThatDoNotCross) {
  const Foothold stance{{0, 0.105}, 0}, step{{0.1, -0.085}, 0}, far{{0.1, 0.5}, 1};
  const Foothold moved = Towards(step, far, 0.03, stance, Foot::kRight, Limits());
  EXPECT_NEAR(moved.position.y(), 0.105 - Limits().least_spacing, 1e-12);
  EXPECT_NEAR(moved.yaw, 0.03, 1e-12);
}

TEST(QuasiStaticWalk, TheRampBeginsWhereItCarriesWhatThePressDoes) {
  for (const double share : {0.0, 0.1, 0.4}) {
    EXPECT_NEAR(balance::SmoothStep(RampStart(share)), share, 1e-9);
  }
}

TEST(Footsteps, ACommandIsApproachedWithoutHaste) {
  WalkCommand now;
  const WalkCommand wanted{{0.3, -0.4}, 0.5, true};
  now = Approach(now, wanted, 0.1, 0.2);
  EXPECT_NEAR(now.velocity.norm(), 0.1, 1e-12);
  EXPECT_NEAR(now.turn_rate, 0.2, 1e-12);
  for (int i = 0; i < 4; ++i) now = Approach(now, wanted, 0.1, 0.2);
  EXPECT_LT((now.velocity - wanted.velocity).norm(), 1e-12);
  // To a stand it slows down first.
  now = Approach(now, {}, 0.1, 1);
  EXPECT_TRUE(now.stepping);
  for (int i = 0; i < 4; ++i) now = Approach(now, {}, 0.1, 1);
  EXPECT_FALSE(now.stepping);
}

/// A robot whose steps come to `share` of what it is told, ahead, aside and in a turn, for `steps`
/// of 0.4 s, from a heading of 2 rad on. Every second step alone goes aside and turns.
void WalkShort(const Vector3d& share, const WalkCommand& command, int steps,
               StrideCorrection* correction) {
  const double period = 0.4;
  Vector2d middle(3, -1);
  double heading = 2;
  for (int i = 0; i < steps; ++i) {
    const WalkCommand told = correction->Corrected(command);
    const double out = i % 2 == 0 ? 2 * period : 0;
    const double turn = share.z() * out * told.turn_rate;
    const Vector2d way(share.x() * period * told.velocity.x(), share.y() * out * told.velocity.y());
    middle += Eigen::Rotation2Dd(heading + 0.5 * turn) * way;
    heading += turn;
    correction->Land(i * period, middle, std::remainder(heading, 2 * std::numbers::pi), command);
  }
}

TEST(StrideCorrection, MakesUpForWhatStepsFallShortOf) {
  const Vector3d share(0.85, 0.95, 0.8);
  StrideCorrection correction;
  WalkShort(share, {{0.5, -0.1}, 0.3, true}, 40, &correction);
  // A turn rounds the way off by the chord of a step.
  EXPECT_LT((correction.factor() - share.cwiseInverse()).norm(), 0.01)
      << correction.factor().transpose();
}

TEST(StrideCorrection, LeavesWhatIsAsCommandedOrNotKnown) {
  for (const Vector3d& share : {Vector3d(1, 1, 1), Vector3d(0.5, 0.5, 0.5)}) {
    StrideCorrection correction;
    if (share == Vector3d::Ones()) WalkShort(share, {{0.5, 0}, 0, true}, 20, &correction);
    WalkShort(share, {{0, 0}, 0, true}, 20, &correction);  // nothing is asked for
    for (int i = 0; i < 20; ++i) {                         // never two of one command
      correction.Forget();
      WalkShort(share, {{0.5 + 0.01 * i, 0}, 0.3, true}, 2, &correction);
    }
    EXPECT_LT((correction.factor() - Vector3d::Ones()).norm(), 1e-12);
  }
}

TEST(StrideCorrection, StaysWithinBounds) {
  StrideCorrection correction;
  WalkShort({0, 3, 0}, {{0.5, 0.1}, 0.3, true}, 100, &correction);
  EXPECT_LT((correction.factor() - Vector3d(1.4, 0.9, 1.4)).norm(), 1e-12);
}

TEST(SoleMemory, SinksByItsSpringAndNotByLyingDown) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const robot::FootModel& foot = model.feet()[0];
  // Ground tilted by 8 degrees about both axes; each corner stands on a quarter of its stiffness.
  const double tilt = 8 * std::numbers::pi / 180, load = 52, weight = 520;
  const Eigen::Matrix3d lies =
      (Eigen::AngleAxisd(tilt, Vector3d::UnitX()) * Eigen::AngleAxisd(tilt, Vector3d::UnitY()))
          .toRotationMatrix();
  for (const double stiffness : {2e3, 2e4, 1e9}) {
    // Level, it touches with the corner that is the highest once it lies.
    double highest = 0;
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        const Vector3d corner = lies * Vector3d(x * foot.length, y * foot.width, 0);
        highest = std::max(highest, corner.z());
      }
    }
    Eigen::Isometry3d sole = Eigen::Isometry3d::Identity();
    sole.translation().z() = 0.03 + highest;
    SoleMemory pressed(foot);
    pressed.Touch(sole);
    EXPECT_EQ(pressed.Sunk(sole), 0);
    sole.linear() = lies;
    sole.translation().z() = 0.03 - load / stiffness;
    const double sunk = pressed.Sunk(sole);
    EXPECT_NEAR(sunk, load / stiffness, 1e-9) << stiffness;
    EXPECT_NEAR(ExpectedSinking(sunk, load, weight), weight / stiffness, 1e-8);
    sole.translation().z() = 0.2;  // up again
    EXPECT_EQ(pressed.Sunk(sole), 0);
  }
  EXPECT_EQ(ExpectedSinking(0.01, 0, weight), 0);
}

TEST(KnownGround, IsTheLastEdgeThatWasPassedInThisFootsLane) {
  KnownGround ground;
  EXPECT_TRUE(ground.empty());
  ground.Add(Foot::kLeft, 0.6, 0.1);
  ground.Add(Foot::kRight, 0.8, 0.2);
  ground.Add(Foot::kLeft, 1.0, 0.3);
  EXPECT_EQ(ground.At(Foot::kLeft, 0.5), 0);
  EXPECT_EQ(ground.At(Foot::kLeft, 0.6), 0.1);
  EXPECT_EQ(ground.At(Foot::kRight, 0.7), 0);
  EXPECT_EQ(ground.At(Foot::kRight, 5), 0.2);
  EXPECT_EQ(ground.At(Foot::kLeft, 1.2), 0.3);
}

}  // namespace
}  // namespace poise::stepping
