// Ways around the standing leg: the legs' lines against the robot's own kinematics, the corner's
// quintics against differences, and no sole upon another.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "components/robot/dynamics.h"
#include "components/robot/posture.h"
#include "components/step_planner/legs/legs.h"
#include "components/step_planner/legs/reach.h"
#include "components/step_planner/legs/swing.h"
#include "components/step_planner/stepping/step_choice.h"
#include "tests/robot/robot_test_support.h"
#include "tests/test_seed.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using robot::TestRobot;

TEST(Legs, SegmentsAreAsFarApartAsTheirNearestPoints) {
  std::mt19937 random{TestSeed(171)};
  std::uniform_real_distribution<double> any(-1, 1);
  const auto point = [&] { return Vector3d(any(random), any(random), any(random)); };
  for (int trial = 0; trial < 60; ++trial) {
    const Vector3d a = point(), c = point();
    // Points, parallels and segments that have nothing of the kind.
    const Vector3d b = trial % 7 == 0 ? a : point();
    const Vector3d d = trial % 5 == 0 ? c : trial % 4 == 0 ? Vector3d(c + 0.7 * (b - a)) : point();
    double least = 10;
    constexpr int kGrid = 200;
    for (int i = 0; i <= kGrid; ++i) {
      const Vector3d one = a + i / double{kGrid} * (b - a);
      for (int k = 0; k <= kGrid; ++k) {
        least = std::min(least, (one - c - k / double{kGrid} * (d - c)).norm());
      }
    }
    const double distance = SegmentDistance(a, b, c, d);
    EXPECT_LE(distance, least + 1e-12);
    EXPECT_GE(distance, least - 0.02);  // half a step of both
  }
}

TEST(Legs, AtTheHighestALegIsStretchedAsAsked) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const Legs legs(model);
  for (const double x : {-0.2, 0.0, 0.3}) {
    for (const Foot foot : kFeet) {
      const Eigen::Vector2d sole(x, 0.1 * Side(foot));
      const LegLine line =
          legs.At(foot, Vector3d(sole.x(), sole.y(), -legs.Highest(foot, sole, 0.9)));
      const double straight = (line.knee - line.hip).norm() + (line.ankle - line.knee).norm();
      EXPECT_NEAR((line.ankle - line.hip).norm(), 0.9 * straight, 1e-9) << x;
    }
  }
}

// Hip, knee and ankle where the robot's own joints are, its feet level and straight ahead.
TEST(Legs, KneesAreWhereTheRobotHasThem) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const Legs legs(model);
  for (const double x : {-0.2, 0.0, 0.2}) {
    robot::PostureGoal goal;
    goal.foot[0] = Eigen::Translation3d(x, -0.12, 0) * Eigen::Isometry3d::Identity();
    goal.foot[1] = Eigen::Translation3d(-x, 0.12, 0) * Eigen::Isometry3d::Identity();
    goal.com_height = legs.height() - 0.05;
    goal.nominal = model.stance().joint_position;
    robot::RobotData data(model);
    robot::ComputeKinematics(model, robot::SolvePosture(model, goal), &data);
    for (const Foot foot : kFeet) {
      const auto joint = [&](const char* name) -> Vector3d {
        const std::string whole = std::string(foot == Foot::kRight ? "right_" : "left_") + name;
        for (size_t j = 0; j < model.joints().size(); ++j) {
          if (model.joints()[j].name == whole) return data.body_position[j + 1];
        }
        ADD_FAILURE() << "no joint " << whole;
        return Vector3d::Zero();
      };
      const Vector3d hip = joint("hip_yaw"), knee = joint("knee_pitch"),
                     ankle = joint("ankle_pitch");
      // The COM moves with the legs: seen from the hip.
      LegLine line = legs.At(foot, Vector3d(0, 0, -legs.height()));
      const Vector3d sole =
          Vector3d(0, 0, -legs.height()) + (ankle - hip) - (line.ankle - line.hip);
      line = legs.At(foot, sole);
      EXPECT_LT((line.ankle - line.hip - (ankle - hip)).norm(), 1e-6);
      EXPECT_LT((line.knee - line.hip - (knee - hip)).norm(), 0.02)
          << x << ' ' << robot::Index(foot);
    }
  }
}

TEST(Swing, AWayAroundIsSmoothAndOutsideItsCorner) {
  std::mt19937 random{TestSeed(172)};
  std::uniform_real_distribution<double> any(0, 1);
  const SwingSpec spec{.clearance = 0.05, .touch_speed = 0.25, .freeze = 0.05};
  const Vector2d corner(0.32, 0.17);
  for (int trial = 0; trial < 40; ++trial) {
    const Vector3d start(0.05 * any(random), 0.17 + 0.06 * any(random), 0.05);
    const auto goal = [&] { return Vector2d(0.32 + 0.3 * any(random), 0.16 - 0.4 * any(random)); };
    Vector2d foothold = goal();
    Swing swing;
    swing.Begin({.position = start}, Eigen::Matrix3d::Identity(), {foothold.x(), foothold.y(), 0},
                Eigen::Matrix3d::Identity(), 0, 0.4, spec);
    swing.GoAround(corner);
    const double dt = 1e-4;
    PointMotion last = swing.At(0);
    EXPECT_LT((last.position - start).norm() + last.velocity.norm(), 1e-12);
    double largest = 0;
    const bool moves = trial % 2 == 1;
    for (int i = 1; i * dt < 0.4; ++i) {
      const double time = i * dt;
      if (moves && i % 100 == 0) {
        foothold += 0.01 * Vector2d(any(random), any(random) - 0.5);
        swing.Move(foothold, time, 0.4);
      }
      const PointMotion now = swing.At(time);
      EXPECT_LT((now.position - last.position - 0.5 * dt * (now.velocity + last.velocity)).norm(),
                1e-8);
      EXPECT_LT(
          (now.velocity - last.velocity - 0.5 * dt * (now.acceleration + last.acceleration)).norm(),
          1e-4);
      // 5 mm of the way around are all that a foothold which moves may cost.
      EXPECT_TRUE(now.position.x() > corner.x() - 0.005 || now.position.y() > corner.y() - 0.005)
          << now.position.transpose() << " to " << foothold.transpose() << " at " << time;
      largest = std::max(largest, (now.velocity - last.velocity).head<2>().norm() / dt);
      last = now;
    }
    EXPECT_LT((swing.At(swing.end()).position - swing.foothold()).norm(), 1e-9);
    if (moves) continue;
    const double said = CornerAcceleration(start.head<2>(), corner, foothold) / (0.4 * 0.4);
    EXPECT_NEAR(said, largest, 0.04 * largest);
    // A detour takes longer than the straight way.
    EXPECT_GT(std::sqrt(said), LeastSwingTime((foothold - start.head<2>()).norm(), 1) / 0.4);
  }
}

class AroundCase : public testing::TestWithParam<TestRobot> {
 protected:
  robot::RobotModel model_ = robot::LoadTestRobot(GetParam());
  double height_ = robot::StandingHeight(model_);
  double spacing_ = robot::StandingSpacing(model_);
  double gap_ = 0.02;
};

/// m between two level soles in line with the axes: of their bounds, along the axis that parts
/// them.
double Between(const robot::FootModel& a, const Vector2d& at_a, const robot::FootModel& b,
               const Vector2d& at_b) {
  const balance::ConvexPolygon one = SoleAt(a, 0, at_a, 0), other = SoleAt(b, 0, at_b, 0);
  double apart = -1;
  for (int axis = 0; axis < 2; ++axis) {
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    for (const Vector2d& corner : one.corners()) {
      low[0] = std::min(low[0], corner[axis]);
      high[0] = std::max(high[0], corner[axis]);
    }
    for (const Vector2d& corner : other.corners()) {
      low[1] = std::min(low[1], corner[axis]);
      high[1] = std::max(high[1], corner[axis]);
    }
    apart = std::max({apart, low[0] - high[1], low[1] - high[0]});
  }
  return apart;
}

// On the right foot, pushed anywhere: no foothold and no way to it upon the standing sole or leg.
TEST_P(AroundCase, NoSoleOrLegMeetsTheOther) {
  const Reach reach(model_, height_, 0.03, gap_);
  StepLimits limits{.sole_margin = 0.01,
                    .acceleration = 60,
                    .least_swing = 0.2,
                    .unload = 0.04,
                    .overshoot = 0.04,
                    .ample_margin = 0.04,
                    .spacing = std::max(spacing_, reach.least_spacing()),
                    .leg_distance = 0.12};
  const StepChoice choice(model_, reach, limits);
  const Legs legs(model_);
  std::mt19937 random{TestSeed(173)};
  std::uniform_real_distribution<double> any(-1, 1);
  int around = 0, across = 0;
  for (int trial = 0; trial < 200; ++trial) {
    StepState state;
    state.pendulum.frequency = std::sqrt(robot::kGravity / height_);
    const double angle = M_PI * any(random), speed = 0.75 + 0.5 * any(random);
    state.pendulum.velocity = speed * Vector2d(std::cos(angle), std::sin(angle));
    state.sole = {Vector2d::Zero(), Vector2d(0, limits.spacing)};
    state.in_contact = {true, false};
    const StepPlan plan = choice.Choose(state);
    if (!plan.possible) continue;
    ASSERT_EQ(plan.foot, Foot::kLeft);
    EXPECT_GE(Between(model_.feet()[0], state.sole[0], model_.feet()[1], plan.foothold),
              gap_ - 1e-9);
    Swing swing;
    swing.Begin({.position = {state.sole[1].x(), state.sole[1].y(), 0}},
                Eigen::Matrix3d::Identity(), {plan.foothold.x(), plan.foothold.y(), 0},
                Eigen::Matrix3d::Identity(), 0, plan.time, {.clearance = 0.03});
    if (plan.around) swing.GoAround(plan.corner);
    around += plan.around;
    across += plan.foothold.y() < 0;
    for (double time = 0; time <= plan.time; time += 0.01) {
      const Vector3d sole = swing.At(time).position;
      EXPECT_GE(
          Between(model_.feet()[0], state.sole[0], model_.feet()[1], Vector2d(sole.head<2>())),
          gap_ - 0.006);
      if (plan.crossing == Crossing::kNone) continue;
      const Vector2d com = After(state.pendulum, plan.cop, time).com;
      const Vector3d middle(com.x(), com.y(), height_ - 0.03);
      // Twice the radius of a leg of 5 cm.
      EXPECT_GT(LegDistance(legs.At(Foot::kLeft, sole - middle), legs.At(Foot::kRight, -middle)),
                0.1)
          << plan.foothold.transpose() << " at " << time << " of " << plan.time;
    }
  }
  EXPECT_GT(around, 20);
  EXPECT_GT(across, 5);
}

INSTANTIATE_TEST_SUITE_P(Robots, AroundCase, testing::Values(TestRobot::kDyros));

}  // namespace
}  // namespace poise::stepping
