#include "components/robot/sole.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace poise::robot {
namespace {

using Eigen::Vector2d;

// m: a corner that stands out by less is a rounding of a straight edge.
constexpr double kLeastCorner = 1e-5;
// m: what a corner of an outline stands out by, so that rounding does not make it less than that.
constexpr double kSureCorner = 2 * kLeastCorner;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// m, from the line from `a` to `b` to `point`, positive on its left.
double LeftOf(const Vector2d& a, const Vector2d& b, const Vector2d& point) {
  const Vector2d edge = b - a;
  return Cross(edge, point - a) / edge.norm();
}

}  // namespace

std::string SoleProblem(std::span<const Vector2d> vertices) {
  const size_t n = vertices.size();
  if (n < 3) return fmt::format("has {} corners: give at least 3, or length and width", n);
  if (n > static_cast<size_t>(kMaxSoleVertices)) {
    return fmt::format("has {} corners: give at most {}, leave out those that add least area", n,
                       kMaxSoleVertices);
  }
  double area = 0;
  for (size_t i = 0; i < n; ++i) {
    if (!vertices[i].allFinite()) return fmt::format("[{}] is not finite: correct it", i);
    area += 0.5 * Cross(vertices[i], vertices[(i + 1) % n]);
  }
  if (area < 0) return "runs clockwise: list the corners anticlockwise, seen from above";
  double turn = 0;  // rad, all in all: once round, a star goes round twice
  for (size_t i = 0; i < n; ++i) {
    const Vector2d &before = vertices[(i + n - 1) % n], &corner = vertices[i],
                   &after = vertices[(i + 1) % n];
    // !(x >= y): NaN of two equal corners.
    if (!(LeftOf(before, after, corner) <= -kLeastCorner)) {
      return fmt::format(
          "[{}] ({}, {}) is no corner of a convex polygon: leave it out, or give the convex hull",
          i, corner.x(), corner.y());
    }
    const Vector2d in = corner - before, out = after - corner;
    turn += std::atan2(Cross(in, out), in.dot(out));
  }
  if (turn > 7) return "goes round more than once: give the convex hull's corners";
  for (size_t i = 0; i < n; ++i) {
    if (!(LeftOf(vertices[i], vertices[(i + 1) % n], Vector2d::Zero()) >= kLeastCorner)) {
      return fmt::format(
          "does not have the sole frame's origin inside (edge {}): move the foot's `sole` into the "
          "polygon and the corners against it",
          i);
    }
  }
  return {};
}

std::vector<Vector2d> SoleOutline(std::vector<Vector2d> points, size_t most) {
  // Andrew's monotone chain: the lower side, then the upper one.
  std::ranges::sort(points, [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Vector2d> hull;
  for (int side = 0; side < 2; ++side) {
    const size_t begin = hull.size();
    for (const Vector2d& point : points) {
      while (hull.size() >= begin + 2 &&
             !(Cross(hull.back() - hull[hull.size() - 2], point - hull.back()) > 0)) {
        hull.pop_back();
      }
      hull.push_back(point);
    }
    if (!hull.empty()) hull.pop_back();
    std::ranges::reverse(points);
  }
  while (hull.size() >= 3) {
    const size_t n = hull.size();
    size_t least = n;
    double area = HUGE_VAL;
    for (size_t i = 0; i < n; ++i) {
      const Vector2d &before = hull[(i + n - 1) % n], &after = hull[(i + 1) % n];
      const bool sure = LeftOf(before, after, hull[i]) <= -kSureCorner;
      const double cost = Cross(hull[i] - before, after - before);
      if ((n > most || !sure) && cost < area) area = cost, least = i;
    }
    if (least == n) break;
    hull.erase(hull.begin() + static_cast<std::ptrdiff_t>(least));
  }
  return hull;
}

std::vector<Vector2d> SoleCorners(const FootModel& foot) {
  if (!foot.rectangular()) return foot.vertices;
  const double x = 0.5 * foot.length, y = 0.5 * foot.width;
  return {{x, y}, {-x, y}, {x, -y}, {-x, -y}};
}

double DistanceInside(const FootModel& foot, const Vector2d& point) {
  if (foot.rectangular()) {
    return std::min(0.5 * foot.length - std::abs(point.x()),
                    0.5 * foot.width - std::abs(point.y()));
  }
  double least = HUGE_VAL;
  const Vector2d* before = &foot.vertices.back();
  for (const Vector2d& vertex : foot.vertices) {
    least = std::min(least, LeftOf(*before, vertex, point));
    before = &vertex;
  }
  return least;
}

double InnerRadius(const FootModel& foot) { return DistanceInside(foot, Vector2d::Zero()); }

}  // namespace poise::robot
