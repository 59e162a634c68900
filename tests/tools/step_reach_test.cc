// The farthest edge that a step can make, against footholds drawn at random.
#include "tools/scenario/step_reach.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "components/robot_files/robot_files.h"
#include "components/step_planner/recovery_config.h"

namespace poise {
namespace {

using Eigen::Vector2d;
using stepping::Crossing;

stepping::StepChoice Choice() {
  const robot::RobotModel model =
      robot::LoadRobotFiles(POISE_SOURCE_DIR "/deploy/robots/dyros/dyros_legs.pbtxt", nullptr);
  return MakeStepChoice(model);
}

/// Where the ray leaves a convex polygon that its start lies in, by bisection.
double Leaves(const balance::ConvexPolygon& polygon, const Vector2d& from, const Vector2d& along) {
  double inside = 0, outside = 3;
  while (outside - inside > 1e-6) {
    const double middle = (inside + outside) / 2;
    (balance::Contains(polygon, from + middle * along) ? inside : outside) = middle;
  }
  return inside;
}

TEST(FarthestSupport, IsTheFarthestOfFootholdsDrawnAtRandom) {
  const stepping::StepChoice choice = Choice();
  const stepping::Reach& reach = choice.reach();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  // On a segment between two corners, half of them at its ends: the farthest lie there.
  const auto draw = [&](const balance::ConvexPolygon& polygon) {
    const auto corner = [&] {
      return polygon.corner[random() % static_cast<size_t>(polygon.num_corners)];
    };
    const Vector2d first = corner(), second = corner();
    return Vector2d(first + std::clamp(2 * share(random) - 0.5, 0.0, 1.0) * (second - first));
  };
  for (const robot::Foot stance : robot::kFeet) {
    const robot::Foot foot = Other(stance);
    const double yaw = 0.4;
    const Vector2d sole(0.3, -0.2);
    const auto standing = stepping::SoleAt(choice.foot(stance), 0, sole, yaw);
    std::array<double, 8> drawn{};
    for (int i = 0; i < 4000; ++i) {
      // In axes of the stance sole.
      const Vector2d com = -draw(reach.Leg(stance, 1));
      const auto footholds = reach.Footholds(
          foot, com,
          std::array{Crossing::kNone, Crossing::kInFront, Crossing::kBehind}[random() % 3]);
      if (footholds.num_corners == 0) continue;
      const Vector2d foothold = draw(footholds);
      const auto landed =
          stepping::SoleAt(choice.foot(foot), 0, sole + Eigen::Rotation2Dd(yaw) * foothold, yaw);
      const auto support = stepping::HullOf(standing, landed);
      for (size_t d = 0; d < drawn.size(); ++d) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(d) / 8;
        drawn[d] = std::max(drawn[d], Leaves(support, sole, {std::cos(angle), std::sin(angle)}));
      }
    }
    for (size_t i = 0; i < drawn.size(); ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / 8;
      const auto farthest =
          FarthestSupport(choice, stance, sole, yaw, sole, {std::cos(angle), std::sin(angle)});
      ASSERT_TRUE(farthest);
      EXPECT_GE(*farthest, drawn[i] - 1e-5) << "foot " << robot::Index(foot) << ", direction " << i;
      EXPECT_LE(*farthest, drawn[i] + 0.03) << "foot " << robot::Index(foot) << ", direction " << i;
    }
  }
}

TEST(FarthestSupport, WithoutReachThereIsNone) {
  EXPECT_FALSE(
      FarthestSupport(stepping::StepChoice(), robot::Foot::kRight, {0, 0}, 0, {0, 0}, {1, 0}));
}

TEST(DistanceToEdge, OfASquareAndOfARayThatMissesIt) {
  const std::array<Vector2d, 4> square{Vector2d(-1, -1), {1, -1}, {1, 1}, {-1, 1}};
  EXPECT_NEAR(*DistanceToEdge(square, {0.25, 0}, {1, 0}), 0.75, 1e-12);
  EXPECT_NEAR(*DistanceToEdge(square, {0, 0}, Vector2d(1, 1).normalized()), std::sqrt(2), 1e-12);
  EXPECT_FALSE(DistanceToEdge(square, {0, 2}, {1, 0}));
}

}  // namespace
}  // namespace poise
