#include "components/balance/convex_polygon.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace poise::balance {
namespace {

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// m: hulls are of points on a grid of this step, where the order of points and the turns between
// them agree whatever rounding did to the points: far above rounding, far below a sole's margin.
constexpr double kGrid = 1e-9;
// Steps of the grid: a corner that stands out by no more is on a line.
constexpr double kStraight = 2;

struct GridPoint {
  Eigen::Vector2d at;  // in steps
  size_t index;        // of the point given
};

/// `next` goes on anticlockwise from the edge before.
bool TurnsLeft(const GridPoint& before, const GridPoint& corner, const GridPoint& next) {
  return Cross(corner.at - before.at, next.at - corner.at) > 0;
}

bool IsStraight(const GridPoint& before, const GridPoint& corner, const GridPoint& next) {
  const Eigen::Vector2d chord = next.at - before.at;
  return Cross(corner.at - before.at, next.at - corner.at) <= kStraight * chord.norm();
}

Eigen::Vector2d NearestOnSegment(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                 const Eigen::Vector2d& point) {
  const Eigen::Vector2d edge = b - a;
  const double along = edge.dot(point - a), length = edge.squaredNorm();
  // The ends exact.
  if (!(along > 0)) return a;
  if (along >= length) return b;
  return a + edge * (along / length);
}

Eigen::Vector2d NearestOnBoundary(const ConvexPolygon& polygon, const Eigen::Vector2d& point) {
  Eigen::Vector2d best = polygon.corners().back(), a = best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& b : polygon.corners()) {
    const Eigen::Vector2d nearest = NearestOnSegment(a, b, point);
    const double distance = (point - nearest).squaredNorm();
    if (distance < least) {
      least = distance;
      best = nearest;
    }
    a = b;
  }
  return best;
}

}  // namespace

ConvexPolygon ConvexHull(std::span<const Eigen::Vector2d> points) {
  ConvexPolygon hull;
  const size_t n = std::min<size_t>(points.size(), ConvexPolygon::kMaxCorners);
  std::array<GridPoint, ConvexPolygon::kMaxCorners> sorted;
  for (size_t i = 0; i < n; ++i) {
    if (!points[i].allFinite()) return hull;
    sorted[i] = {(points[i] / kGrid).array().round(), i};
  }
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(n);
  std::sort(sorted.begin(), end, [](const GridPoint& a, const GridPoint& b) {
    if (a.at.x() != b.at.x()) return a.at.x() < b.at.x();
    return a.at.y() < b.at.y() || (a.at.y() == b.at.y() && a.index < b.index);
  });
  const auto equal = [](const GridPoint& a, const GridPoint& b) { return a.at == b.at; };
  const auto m = static_cast<size_t>(std::unique(sorted.begin(), end, equal) - sorted.begin());
  // Andrew's monotone chain.
  std::array<GridPoint, 2 * ConvexPolygon::kMaxCorners> chain;
  size_t count = 0;
  const auto append = [&](const GridPoint& point, size_t first) {
    while (count >= first + 2 && !TurnsLeft(chain[count - 2], chain[count - 1], point)) --count;
    chain[count++] = point;
  };
  for (size_t i = 0; i < m; ++i) append(sorted[i], 0);
  if (m > 2) {
    const size_t upper = count - 1;
    for (size_t i = m - 1; i-- > 0;) append(sorted[i], upper);
    --count;  // the last is the first
  }
  for (size_t i = 0; i < count && count > 2;) {
    if (IsStraight(chain[(i + count - 1) % count], chain[i], chain[(i + 1) % count])) {
      std::copy(chain.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                chain.begin() + static_cast<std::ptrdiff_t>(count),
                chain.begin() + static_cast<std::ptrdiff_t>(i));
      --count;
      i = 0;
    } else {
      ++i;
    }
  }
  for (size_t i = 0; i < count; ++i) hull.corner[i] = points[chain[i].index];
  hull.num_corners = static_cast<int>(count);
  return hull;
}

ConvexPolygon Rectangle(const Eigen::Vector2d& half) {
  ConvexPolygon rectangle;
  rectangle.num_corners = 4;
  rectangle.corner[0] = -half;
  rectangle.corner[1] = {half.x(), -half.y()};
  rectangle.corner[2] = half;
  rectangle.corner[3] = {-half.x(), half.y()};
  return rectangle;
}

HalfPlanes EdgesOf(const ConvexPolygon& polygon) {
  HalfPlanes edges;
  if (polygon.num_corners < 3) return edges;
  Eigen::Vector2d a = polygon.corners().back();
  for (const Eigen::Vector2d& b : polygon.corners()) {
    const Eigen::Vector2d along = (b - a).normalized();
    const Eigen::Vector2d normal(along.y(), -along.x());
    edges.plane[static_cast<size_t>(edges.count++)] = {normal, normal.dot(a)};
    a = b;
  }
  return edges;
}

ConvexPolygon CornersOf(const HalfPlanes& edges) {
  ConvexPolygon polygon;
  if (edges.count < 3) return polygon;
  for (size_t i = 0; i < edges.planes().size(); ++i) {
    // Corner i is where edge i ends and the next one starts.
    const HalfPlane &edge = edges.plane[i], &next = edges.plane[(i + 1) % edges.planes().size()];
    Eigen::Matrix2d normals;
    normals << edge.normal.transpose(), next.normal.transpose();
    polygon.corner[i] = normals.inverse() * Eigen::Vector2d(edge.offset, next.offset);
    ++polygon.num_corners;
  }
  return polygon;
}

ConvexPolygon Clip(const ConvexPolygon& polygon, const HalfPlane& plane) {
  // Each corner cut off leaves at most two: one more than there were.
  std::array<Eigen::Vector2d, ConvexPolygon::kMaxCorners + 1> kept;
  size_t count = 0;
  if (polygon.num_corners < 3) return {};
  const auto append = [&](const Eigen::Vector2d& point) {
    if (count < kept.size()) kept[count++] = point;
  };
  Eigen::Vector2d a = polygon.corners().back();
  double outside_a = plane.normal.dot(a) - plane.offset;
  for (const Eigen::Vector2d& b : polygon.corners()) {
    const double outside_b = plane.normal.dot(b) - plane.offset;
    if ((outside_a > 0) != (outside_b > 0)) {
      append(a + (b - a) * (outside_a / (outside_a - outside_b)));
    }
    if (!(outside_b > 0)) append(b);
    a = b;
    outside_a = outside_b;
  }
  const ConvexPolygon hull = ConvexHull({kept.data(), count});
  return hull.num_corners < 3 ? ConvexPolygon() : hull;
}

ConvexPolygon Inset(const ConvexPolygon& polygon, double margin) {
  ConvexPolygon rest = polygon.num_corners < 3 ? ConvexPolygon() : polygon;
  if (margin == 0) return rest;
  const HalfPlanes edges = EdgesOf(polygon);
  for (HalfPlane plane : edges.planes()) {
    plane.offset -= margin;
    rest = Clip(rest, plane);
  }
  return rest;
}

ConvexPolygon WithFewerCorners(ConvexPolygon polygon, int most) {
  while (polygon.num_corners > std::max(most, 3)) {
    const auto corners = polygon.corners();
    const size_t n = corners.size();
    size_t cheapest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < n; ++i) {
      const Eigen::Vector2d& before = corners[(i + n - 1) % n];
      const double cost = Cross(corners[i] - before, corners[(i + 1) % n] - before);
      if (cost < least) {
        least = cost;
        cheapest = i;
      }
    }
    std::copy(polygon.corner.begin() + static_cast<std::ptrdiff_t>(cheapest) + 1,
              polygon.corner.begin() + polygon.num_corners,
              polygon.corner.begin() + static_cast<std::ptrdiff_t>(cheapest));
    --polygon.num_corners;
  }
  return polygon;
}

Eigen::Vector2d LargestRectangle(const HalfPlanes& region, const Eigen::Vector2d& given) {
  // |n_x| x + |n_y| y ≤ offset for each edge.
  const auto other = [&](double half, int axis) {
    double least = std::numeric_limits<double>::infinity();
    for (const HalfPlane& plane : region.planes()) {
      const double slope = std::abs(plane.normal[1 - axis]);
      const double room = plane.offset - std::abs(plane.normal[axis]) * half;
      if (room <= 0) return 0.0;
      if (slope > 0) least = std::min(least, room / slope);
    }
    return std::isfinite(least) ? least : 0.0;
  };
  if (given.x() > 0) return {given.x(), given.y() > 0 ? given.y() : other(given.x(), 0)};
  if (given.y() > 0) return {other(given.y(), 1), given.y()};
  // other(x) is concave, and so is the logarithm of the area x · other(x): it has one top.
  double low = 0, high = other(0, 1);
  const auto area = [&](double x) { return x * other(x, 0); };
  constexpr double kGolden = 0.6180339887498949;
  for (int i = 0; i < 100; ++i) {
    const double left = high - kGolden * (high - low), right = low + kGolden * (high - low);
    (area(left) < area(right) ? low : high) = area(left) < area(right) ? left : right;
  }
  const double x = 0.5 * (low + high);
  return {x, other(x, 0)};
}

bool Contains(const ConvexPolygon& polygon, const Eigen::Vector2d& point) {
  if (polygon.num_corners < 3) return false;
  Eigen::Vector2d a = polygon.corners().back();
  for (const Eigen::Vector2d& b : polygon.corners()) {
    if (!(Cross(b - a, point - a) >= 0)) return false;
    a = b;
  }
  return true;
}

Eigen::Vector2d NearestPoint(const ConvexPolygon& polygon, const Eigen::Vector2d& point) {
  return Contains(polygon, point) ? point : NearestOnBoundary(polygon, point);
}

double SignedDistance(const ConvexPolygon& polygon, const Eigen::Vector2d& point) {
  if (polygon.num_corners == 0) return -std::numeric_limits<double>::infinity();
  const double distance = (point - NearestOnBoundary(polygon, point)).norm();
  return Contains(polygon, point) ? distance : -distance;
}

}  // namespace poise::balance
