#include "components/balance/convex_polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace poise::balance {
namespace {

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// A corner that turns by less than this, relative to its edges' lengths, is on a line.
constexpr double kStraight = 1e-12;
// m, within which points count as on one line along y: far above rounding, far below a sole's
// margin.
constexpr double kAligned = 1e-9;

/// `next` goes on anticlockwise from the edge before.
bool TurnsLeft(const Eigen::Vector2d& before, const Eigen::Vector2d& at,
               const Eigen::Vector2d& next) {
  const Eigen::Vector2d in = at - before, out = next - at;
  return Cross(in, out) > kStraight * in.norm() * out.norm();
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

/// Inside or on the edge of a polygon with an area.
bool Contains(const ConvexPolygon& polygon, const Eigen::Vector2d& point) {
  if (polygon.num_corners < 3) return false;
  Eigen::Vector2d a = polygon.corners().back();
  for (const Eigen::Vector2d& b : polygon.corners()) {
    if (!(Cross(b - a, point - a) >= 0)) return false;
    a = b;
  }
  return true;
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
  // Andrew's monotone chain. Order and turns are those of points whose x is a whole number of
  // kAligned: on a line along y they then come in order along it, whatever rounding does to their x.
  // Both must be of the same points: else the chain may cross itself.
  struct Corner {
    Eigen::Vector2d at, given;
  };
  ConvexPolygon hull;
  const size_t n = std::min<size_t>(points.size(), ConvexPolygon::kMaxCorners);
  std::array<Corner, ConvexPolygon::kMaxCorners> sorted;
  for (size_t i = 0; i < n; ++i) {
    if (!points[i].allFinite()) return hull;
    sorted[i] = {{std::round(points[i].x() / kAligned) * kAligned, points[i].y()}, points[i]};
  }
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(n);
  std::sort(sorted.begin(), end, [](const Corner& a, const Corner& b) {
    if (a.at.x() != b.at.x()) return a.at.x() < b.at.x();
    return a.at.y() < b.at.y() || (a.at.y() == b.at.y() && a.given.x() < b.given.x());
  });
  const auto same = [](const Corner& a, const Corner& b) { return a.at == b.at; };
  const auto m = static_cast<size_t>(std::unique(sorted.begin(), end, same) - sorted.begin());
  std::array<Corner, 2 * ConvexPolygon::kMaxCorners> chain;
  size_t count = 0;
  const auto append = [&](const Corner& point, size_t first) {
    while (count >= first + 2 && !TurnsLeft(chain[count - 2].at, chain[count - 1].at, point.at)) {
      --count;
    }
    chain[count++] = point;
  };
  for (size_t i = 0; i < m; ++i) append(sorted[i], 0);
  const size_t upper = count - 1;
  for (size_t i = m - 1; m > 2 && i-- > 0;) append(sorted[i], upper);
  if (m > 2) --count;  // the last is the first
  hull.num_corners = static_cast<int>(count);
  for (size_t i = 0; i < count; ++i) hull.corner[i] = chain[i].given;
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

Eigen::Vector2d NearestPoint(const ConvexPolygon& polygon, const Eigen::Vector2d& point) {
  return Contains(polygon, point) ? point : NearestOnBoundary(polygon, point);
}

double SignedDistance(const ConvexPolygon& polygon, const Eigen::Vector2d& point) {
  if (polygon.num_corners == 0) return -std::numeric_limits<double>::infinity();
  const double distance = (point - NearestOnBoundary(polygon, point)).norm();
  return Contains(polygon, point) ? distance : -distance;
}

}  // namespace poise::balance
