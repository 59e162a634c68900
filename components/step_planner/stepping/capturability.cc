#include "components/step_planner/stepping/capturability.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "components/balance/support_polygon.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;

Vector2d Farthest(const balance::ConvexPolygon& polygon, const Vector2d& direction) {
  Vector2d farthest = Vector2d::Zero();
  double most = -std::numeric_limits<double>::infinity();
  for (const Vector2d& corner : polygon.corners()) {
    const double reached = corner.dot(direction);
    if (reached <= most) continue;
    most = reached;
    farthest = corner;
  }
  return farthest;
}

}  // namespace

CaptureRegions RegionsAbout(const StepChoice& choice, const RegionInput& input) {
  const StepLimits& limits = choice.limits();
  std::array<balance::ConvexPolygon, 2> sole, footholds;
  for (int foot = 0; foot < 2; ++foot) {
    const auto i = static_cast<size_t>(foot);
    sole[i] = balance::SolePolygon(choice.foot(foot), limits.edge);
    // Of this foot, the other one at the origin.
    footholds[i] = choice.reach().Footholds(foot, Vector2d::Zero());
  }
  CaptureRegions result;
  if (sole[0].num_corners == 0 || sole[1].num_corners == 0) return result;
  const bool steps = footholds[0].num_corners > 0 && footholds[1].num_corners > 0;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(input.yaw).toRotationMatrix();
  std::array<std::array<Vector2d, kRegionDirections>, kMostRegionSteps + 1> corner;
  for (int k = 0; k < kRegionDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kRegionDirections;
    const Vector2d direction(std::cos(angle), std::sin(angle));
    // About each foot, of the number of steps before.
    std::array<Vector2d, 2> before, now;
    for (size_t i = 0; i < 2; ++i) before[i] = Farthest(sole[i], direction);
    const std::array<Vector2d, 2> edge = before;
    for (int n = 0; n <= kMostRegionSteps; ++n) {
      const auto steps_made = static_cast<size_t>(n);
      if (n > 0 && steps) {
        for (int stance = 0; stance < 2; ++stance) {
          const auto s = static_cast<size_t>(stance), o = 1 - s;
          const double side = stance == robot::kRightFoot ? 1 : -1;
          const Vector2d foothold = Farthest(footholds[o], direction);
          double time = input.step_time;
          if (time <= 0) {
            const double way = (foothold - Vector2d(0, side * limits.spacing)).norm();
            time =
                limits.unload + std::max(limits.least_swing, SwingTime(way, limits.acceleration));
          }
          if (stance == input.stance && n == 1) {
            result.shortest = k == 0 ? time : std::min(result.shortest, time);
            result.longest = std::max(result.longest, time);
          }
          const double decay = std::exp(-input.frequency * time);
          now[s] = (1 - decay) * edge[s] + decay * (foothold + before[o]);
          if (before[s].dot(direction) > now[s].dot(direction)) now[s] = before[s];
        }
        before = now;
      }
      corner[steps_made][static_cast<size_t>(k)] =
          input.sole + turn * before[static_cast<size_t>(input.stance)];
    }
  }
  for (size_t n = 0; n < corner.size(); ++n) result.region[n] = balance::ConvexHull(corner[n]);
  return result;
}

}  // namespace poise::stepping
