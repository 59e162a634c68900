#include "components/step_planner/stepping/capturability.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
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
  const bool reaches = footholds[0].num_corners > 0 && footholds[1].num_corners > 0;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(input.yaw).toRotationMatrix();
  const auto own = static_cast<size_t>(input.stance);
  const Vector2d planned = turn.transpose() * (input.foothold - input.sole);
  balance::ConvexPolygon around = footholds[1 - own];  // and where the step under way goes
  if (input.under_way) {
    around = HullOf(around, balance::ConvexHull({&planned, 1}));
    result.first = result.longest = input.left;
  }
  std::array<std::array<Vector2d, kRegionDirections>, kMostRegionSteps + 1> corner;
  for (int k = 0; k < kRegionDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kRegionDirections;
    const Vector2d direction(std::cos(angle), std::sin(angle));
    const auto farther = [&](const Vector2d& a, const Vector2d& b) {
      return a.dot(direction) > b.dot(direction) ? a : b;
    };
    const std::array<Vector2d, 2> edge{Farthest(sole[0], direction), Farthest(sole[1], direction)};
    std::array<Vector2d, 2> before = edge;  // about each foot, of the number of steps before
    Vector2d region = edge[own];
    corner[0][static_cast<size_t>(k)] = region;
    for (size_t n = 1; n < corner.size(); ++n) {
      std::array<Vector2d, 2> now = before;
      for (size_t s = 0; s < 2 && reaches; ++s) {
        const double side = s == robot::kRightFoot ? 1 : -1;
        const Vector2d foothold = Farthest(footholds[1 - s], direction);
        double time = input.step_time;
        if (time <= 0) {
          const double way = (foothold - Vector2d(0, side * limits.spacing)).norm();
          time = limits.unload + std::max(limits.least_swing, SwingTime(way, limits.acceleration));
        }
        result.longest = std::max(result.longest, time);
        if (!input.under_way) result.first = std::max(result.first, s == own ? time : 0.0);
        const double decay = std::exp(-input.frequency * time);
        now[s] = farther((1 - decay) * edge[s] + decay * (foothold + before[1 - s]), before[s]);
      }
      if (input.under_way) {
        const Vector2d foothold =
            balance::NearestPoint(around, planned + input.movable * direction);
        const double decay = std::exp(-input.frequency * input.left);
        region = farther((1 - decay) * edge[own] + decay * (foothold + before[1 - own]), region);
      } else {
        region = now[own];
      }
      corner[n][static_cast<size_t>(k)] = region;
      before = now;
    }
  }
  for (auto& corners : corner) {
    for (Vector2d& point : corners) point = input.sole + turn * point;
  }
  for (size_t n = 0; n < corner.size(); ++n) result.region[n] = balance::ConvexHull(corner[n]);
  return result;
}

}  // namespace poise::stepping
