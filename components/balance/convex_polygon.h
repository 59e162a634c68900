// Convex polygons of the plane, of a fixed size: hulls of soles, the nearest point, the distance to
// the edge.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

namespace poise::balance {

/// Corners anticlockwise, no three on a line. None: empty; one: a point; two: a segment.
struct ConvexPolygon {
  static constexpr int kMaxCorners = 16;
  int num_corners = 0;
  std::array<Eigen::Vector2d, kMaxCorners> corner;

  std::span<const Eigen::Vector2d> corners() const {
    return {corner.data(), static_cast<size_t>(num_corners)};
  }
  std::span<Eigen::Vector2d> mutable_corners() {
    return {corner.data(), static_cast<size_t>(num_corners)};
  }
};

/// Hull of at most kMaxCorners points (those beyond are left out), in m, from the one with the
/// least x, and of those the least y, on. Points count as equal, and corners as straight, to some
/// 1e-9 m. Empty when a coordinate is not finite.
ConvexPolygon ConvexHull(std::span<const Eigen::Vector2d> points);

/// The rectangle |x| ≤ half.x, |y| ≤ half.y.
ConvexPolygon Rectangle(const Eigen::Vector2d& half);

/// The polygon's point nearest to `point`: itself when inside. Precondition: not empty.
Eigen::Vector2d NearestPoint(const ConvexPolygon& polygon, const Eigen::Vector2d& point);

/// Distance to the boundary, positive inside, in the corners' unit; −∞ for an empty polygon.
double SignedDistance(const ConvexPolygon& polygon, const Eigen::Vector2d& point);

}  // namespace poise::balance
