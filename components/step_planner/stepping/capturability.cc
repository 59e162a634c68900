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

/// Unit vector of one of the directions.
Vector2d Direction(size_t k) {
  const double angle = 2 * std::numbers::pi * static_cast<double>(k) / kRegionDirections;
  return {std::cos(angle), std::sin(angle)};
}

}  // namespace

RegionFinder::RegionFinder(const StepChoice& choice) {
  const StepLimits& limits = choice.limits();
  FootArray<balance::ConvexPolygon> sole;
  for (const Foot foot : kFeet) {
    sole[foot] = balance::SolePolygon(choice.foot(foot), limits.sole_margin);
    footholds_[foot] = choice.reach().Footholds(foot, Vector2d::Zero(), Crossing::kNone,
                                                StepChoice::CountedLowering(Crossing::kNone));
  }
  stands_ = sole[0].num_corners > 0 && sole[1].num_corners > 0;
  reaches_ = footholds_[0].num_corners > 0 && footholds_[1].num_corners > 0;
  for (const Foot i : kFeet) {
    const double side = Side(i);
    for (size_t k = 0; k < kRegionDirections; ++k) {
      edge_[i][k] = Farthest(sole[i], Direction(k));
      foothold_[i][k] = Farthest(footholds_[i], Direction(k));
      const double way = (foothold_[i][k] - Vector2d(0, side * limits.spacing)).norm();
      time_[i][k] =
          limits.unload + std::max(limits.least_swing, LeastSwingTime(way, limits.acceleration));
    }
  }
}

CaptureRegions RegionFinder::About(const RegionInput& input) const {
  CaptureRegions result;
  if (!stands_) return result;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(input.yaw).toRotationMatrix();
  const Foot own = input.stance;
  const Vector2d planned = turn.transpose() * (input.foothold - input.sole);
  balance::ConvexPolygon around = footholds_[Other(own)];  // and where the step under way goes
  if (input.under_way) {
    around = HullOf(around, balance::ConvexHull({&planned, 1}));
    result.first = result.longest = input.time_left;
  }
  std::array<Points, kMostRegionSteps + 1> corner;
  for (size_t k = 0; k < kRegionDirections; ++k) {
    const Vector2d direction = Direction(k);
    const auto farther = [&](const Vector2d& a, const Vector2d& b) {
      return a.dot(direction) > b.dot(direction) ? a : b;
    };
    const FootArray<Vector2d> edge{edge_[Foot::kRight][k], edge_[Foot::kLeft][k]};
    FootArray<double> decay;  // by the foot that stands
    for (const Foot s : kFeet) {
      if (!reaches_) break;
      const double time = input.step_time > 0 ? input.step_time : time_[Other(s)][k];
      result.longest = std::max(result.longest, time);
      if (!input.under_way) result.first = std::max(result.first, s == own ? time : 0.0);
      decay[s] = std::exp(-input.frequency * time);
    }
    FootArray<Vector2d> before = edge;  // about each foot, of the number of steps before
    Vector2d region = edge[own];
    corner[0][k] = region;
    for (size_t n = 1; n < corner.size(); ++n) {
      FootArray<Vector2d> now = before;
      for (const Foot s : kFeet) {
        if (!reaches_) break;
        const Vector2d& foothold = foothold_[Other(s)][k];
        now[s] =
            farther((1 - decay[s]) * edge[s] + decay[s] * (foothold + before[Other(s)]), before[s]);
      }
      if (input.under_way) {
        const Vector2d foothold =
            balance::NearestPoint(around, planned + input.movable * direction);
        const double left = std::exp(-input.frequency * input.time_left);
        region = farther((1 - left) * edge[own] + left * (foothold + before[Other(own)]), region);
      } else {
        region = now[own];
      }
      corner[n][k] = region;
      before = now;
    }
  }
  for (Points& points : corner) {
    for (Vector2d& point : points) point = input.sole + turn * point;
  }
  for (size_t n = 0; n < corner.size(); ++n) result.region[n] = balance::ConvexHull(corner[n]);
  return result;
}

}  // namespace poise::stepping
