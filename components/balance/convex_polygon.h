// Convex polygons of the plane, of a fixed size: hulls of soles, what a margin leaves of them, the
// nearest point, the distance to the edge.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

namespace poise::balance {

/// Corners anticlockwise, no three on a line. None: empty; one: a point; two: a segment.
struct ConvexPolygon {
  static constexpr int kMaxCorners = 32;  // of the hull of two soles
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

/// normal·r ≤ offset.
struct HalfPlane {
  Eigen::Vector2d normal;  ///< unit
  double offset = 0;       ///< m
};

/// The half-planes whose intersection a polygon with an area is, one for each edge.
struct HalfPlanes {
  int count = 0;
  std::array<HalfPlane, ConvexPolygon::kMaxCorners> plane;

  std::span<const HalfPlane> planes() const { return {plane.data(), static_cast<size_t>(count)}; }
};

/// Empty for a polygon without an area.
HalfPlanes EdgesOf(const ConvexPolygon& polygon);

/// The polygon whose EdgesOf these are; empty of fewer than three.
ConvexPolygon CornersOf(const HalfPlanes& edges);

/// What lies inside the half-plane too; empty when that has no area.
ConvexPolygon Clip(const ConvexPolygon& polygon, const HalfPlane& plane);

/// What lies at least `margin` (m) inside every edge; empty when that has no area.
ConvexPolygon Inset(const ConvexPolygon& polygon, double margin);

/// The polygon less the corners whose loss costs the least area, at most `most` (3 or more) left.
ConvexPolygon WithFewerCorners(ConvexPolygon polygon, int most);

/// The half sides of the largest rectangle |x| ≤ half.x, |y| ≤ half.y inside; where one of `given`
/// is positive, that half side is taken as it is. Zero when there is none.
Eigen::Vector2d LargestRectangle(const HalfPlanes& region, const Eigen::Vector2d& given);

/// Inside or on the edge of a polygon with an area.
bool Contains(const ConvexPolygon& polygon, const Eigen::Vector2d& point);

/// The polygon's point nearest to `point`: itself when inside. Precondition: not empty.
Eigen::Vector2d NearestPoint(const ConvexPolygon& polygon, const Eigen::Vector2d& point);

/// Distance to the boundary, positive inside, in the corners' unit; −∞ for an empty polygon.
double SignedDistance(const ConvexPolygon& polygon, const Eigen::Vector2d& point);

}  // namespace poise::balance
