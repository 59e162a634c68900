// The regions of N steps against the closed form and against the pendulum, foothold by foothold.
#include "components/step_planner/stepping/capturability.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "components/robot/posture.h"
#include "components/step_planner/stepping/pendulum.h"
#include "tests/robot/robot_test_support.h"
#include "tests/test_seed.h"

namespace poise::stepping {
namespace {

using balance::ConvexPolygon;
using Eigen::Vector2d;
using robot::TestRobot;

constexpr double kEdge = 0.02;  // m

StepChoice Choice() {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const Reach reach(model, robot::StandingHeight(model), 0.05, 0.02);
  StepLimits limits;
  limits.sole_margin = kEdge;
  limits.acceleration = 20;
  limits.least_swing = 0.2;
  limits.unload = 0.05;
  limits.spacing = robot::StandingSpacing(model);
  return {model, reach, limits};
}

double Farthest(const ConvexPolygon& polygon, const Vector2d& direction) {
  double most = -1e9;
  for (const Vector2d& corner : polygon.corners()) most = std::max(most, corner.dot(direction));
  return most;
}

ConvexPolygon Footholds(const StepChoice& choice, Foot foot) {
  return choice.reach().Footholds(foot, {0, 0}, Crossing::kNone,
                                  StepChoice::CountedLowering(Crossing::kNone));
}

// Ahead and back both feet reach equally far: r is the sole's half length less the edge, l the
// farthest foothold, and the region is d_N of Koolen et al. 2012, eq. 31.
TEST(CaptureRegions, AreTheClosedFormAheadAndBack) {
  const StepChoice choice = Choice();
  const double yaw = 0.4, frequency = 3.5, time = 0.4;
  const Vector2d sole(0.3, -0.2);
  for (const Foot stance : kFeet) {
    const CaptureRegions regions = RegionFinder(choice).About({stance, sole, yaw, frequency, time});
    EXPECT_EQ(regions.first, time);
    EXPECT_EQ(regions.longest, time);
    for (const double sign : {1.0, -1.0}) {
      const Vector2d along(sign, 0), direction = Eigen::Rotation2Dd(yaw) * along;
      const double rest = 0.5 * choice.foot(stance).length - kEdge;
      const double reach = Farthest(Footholds(choice, Other(stance)), along);
      ASSERT_NEAR(reach, Farthest(Footholds(choice, stance), along), 5e-3);
      for (int steps = 0; steps <= kMostRegionSteps; ++steps) {
        const double region =
            Farthest(regions.region[static_cast<size_t>(steps)], direction) - sole.dot(direction);
        EXPECT_NEAR(region, CaptureRegion(frequency, rest, reach, time, steps), 5e-3)
            << robot::Index(stance) << sign << steps;
      }
    }
  }
}

// A corner of a region can just be caught: of all centres of pressure and footholds the best one
// brings the capture point onto the edge of the region of one step less about that foothold, none
// inside it by more than rounding.
TEST(CaptureRegions, TheirCornersAreJustCaught) {
  const StepChoice choice = Choice();
  std::mt19937 random{TestSeed(171)};
  std::uniform_real_distribution<double> any(0, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const double frequency = 2.5 + 2 * any(random), time = 0.25 + 0.4 * any(random);
    const Foot stance = kFeet[static_cast<size_t>(trial % 2)], other = Other(stance);
    const CaptureRegions about = RegionFinder(choice).About({stance, {0, 0}, 0, frequency, time});
    const CaptureRegions next = RegionFinder(choice).About({other, {0, 0}, 0, frequency, time});
    const ConvexPolygon sole = about.region[0];
    const ConvexPolygon footholds = Footholds(choice, other);
    for (size_t steps = 1; steps < about.region.size(); ++steps) {
      for (int k = 0; k < kRegionDirections; ++k) {
        const double angle = 2 * std::numbers::pi * k / kRegionDirections;
        const Vector2d u(std::cos(angle), std::sin(angle));
        const double edge = Farthest(about.region[steps], u);
        // Nothing less than a step: this direction is the region's of fewer steps.
        if (edge < Farthest(about.region[steps - 1], u) + 1e-9) continue;
        // m that the capture point, from this far along u, ends short of what the best foothold
        // catches.
        const auto left = [&](double from) {
          double best = -1e9;
          for (const Vector2d& cop : sole.corners()) {
            const Vector2d end = CapturePointAfter(from * u, cop, frequency, time);
            for (const Vector2d& foothold : footholds.corners()) {
              best = std::max(best, Farthest(next.region[steps - 1], u) - (end - foothold).dot(u));
            }
          }
          return best;
        };
        EXPECT_GT(left(edge - 1e-6), 0);
        EXPECT_LT(left(edge + 1e-6), 0);
      }
    }
  }
}

// In a step under way whose foothold is fixed the pendulum ends, from a corner, on the edge of the
// new sole or beyond it, and of one step on the same sole's.
TEST(CaptureRegions, OfAStepUnderWayAreAboutItsFoothold) {
  const StepChoice choice = Choice();
  const double frequency = 3.4, time_left = 0.2, yaw = -0.3;
  const Vector2d sole(1, 2), foothold = sole + Eigen::Rotation2Dd(yaw) * Vector2d(0.15, 0.25);
  RegionInput input{Foot::kRight, sole, yaw, frequency, 0.5};
  input.under_way = true;
  input.foothold = foothold;
  input.time_left = time_left;
  const CaptureRegions regions = RegionFinder(choice).About(input);
  EXPECT_EQ(regions.first, time_left);
  const double half = 0.5 * choice.foot(Foot::kLeft).length - kEdge;
  const Vector2d ahead = Eigen::Rotation2Dd(yaw) * Vector2d(1, 0);
  const double edge = Farthest(regions.region[1], ahead);
  const Vector2d cop = sole + half * ahead;
  const Vector2d end = CapturePointAfter(edge * ahead, cop, frequency, time_left);
  EXPECT_NEAR((end - foothold).dot(ahead), half, 1e-6);
  // What can be moved in time catches more.
  input.movable = 0.1;
  const double more = Farthest(RegionFinder(choice).About(input).region[1], ahead);
  EXPECT_GT(more, edge + 1e-3);
  EXPECT_LE(more, edge + 0.1 * std::exp(-frequency * time_left) + 1e-9);
}

TEST(CaptureRegions, GrowWithTheStepsAndStepsTakeWhatTheSwingTakes) {
  const StepChoice choice = Choice();
  const CaptureRegions regions = RegionFinder(choice).About({Foot::kLeft, {0, 0}, 0, 3.6, 0});
  EXPECT_GE(regions.first, choice.limits().unload + choice.limits().least_swing - 1e-12);
  EXPECT_GE(regions.longest, regions.first);
  // Quicker steps catch more.
  const CaptureRegions slow = RegionFinder(choice).About({Foot::kLeft, {0, 0}, 0, 3.6, 0.8});
  EXPECT_GT(slow.first, regions.longest);
  for (int k = 0; k < kRegionDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kRegionDirections;
    const Vector2d u(std::cos(angle), std::sin(angle));
    for (size_t steps = 1; steps < regions.region.size(); ++steps) {
      const double reached = Farthest(regions.region[steps], u);
      EXPECT_GE(reached, Farthest(regions.region[steps - 1], u) - 1e-9);
      EXPECT_GE(reached, Farthest(slow.region[steps], u) - 1e-9);
    }
  }
}

}  // namespace
}  // namespace poise::stepping
