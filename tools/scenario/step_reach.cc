#include "tools/scenario/step_reach.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace poise {
namespace {

using Eigen::Vector2d;

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// What of the hull of `points` satisfies the half-plane: of its corners those inside, and the two
/// ends of its cut. The hull's edges are among the segments between points, and no segment reaches
/// beyond it.
std::vector<Vector2d> ClipHull(const std::vector<Vector2d>& points,
                               const balance::HalfPlane& plane) {
  std::vector<Vector2d> inside, cut;
  const Vector2d line(-plane.normal.y(), plane.normal.x());
  const auto excess = [&](const Vector2d& p) { return plane.normal.dot(p) - plane.offset; };
  for (const Vector2d& a : points) {
    const double in = excess(a);
    if (in > 0) continue;
    inside.push_back(a);
    for (const Vector2d& b : points) {
      const double out = excess(b);
      if (out <= 0) continue;
      const Vector2d at = a + in / (in - out) * (b - a);
      if (cut.empty()) {
        cut = {at, at};
      } else if (line.dot(at) < line.dot(cut[0])) {
        cut[0] = at;
      } else if (line.dot(at) > line.dot(cut[1])) {
        cut[1] = at;
      }
    }
  }
  inside.insert(inside.end(), cut.begin(), cut.end());
  return inside;
}

}  // namespace

std::optional<double> DistanceToEdge(std::span<const Vector2d> points, const Vector2d& from,
                                     const Vector2d& along) {
  std::optional<double> furthest;
  for (const Vector2d& a : points) {
    for (const Vector2d& b : points) {
      const Vector2d segment = b - a;
      const double sine = Cross(along, segment);
      if (std::abs(sine) < 1e-12) continue;
      const double distance = Cross(a - from, segment) / sine;
      const double share = Cross(a - from, along) / sine;
      if (share < 0 || share > 1) continue;
      furthest = std::max(furthest.value_or(distance), distance);
    }
  }
  return furthest;
}

std::optional<double> FarthestSupport(const stepping::StepChoice& choice, robot::Foot stance,
                                      const Vector2d& sole, double yaw, const Vector2d& from,
                                      const Vector2d& along) {
  const stepping::Reach& reach = choice.reach();
  if (reach.empty()) return {};
  const robot::Foot foot = Other(stance);
  const balance::ConvexPolygon stands = reach.Leg(stance, 1), swings = reach.Leg(foot, 1);
  // Seen from the stance sole: with the COM where the stance leg lets it be, the other leg's.
  std::vector<Vector2d> reached;
  for (const Vector2d& a : stands.corners()) {
    for (const Vector2d& b : swings.corners()) reached.push_back(b - a);
  }
  const double side = robot::Side(foot);
  const balance::HalfPlane places[] = {{{0, -side}, -reach.least_spacing()},
                                       {{-1, 0}, -reach.least_ahead()},
                                       {{1, 0}, -reach.least_ahead()}};
  const Eigen::Rotation2Dd turn(-yaw);
  const Vector2d start = turn * (from - sole), way = turn * along;
  const auto standing = stepping::SoleAt(choice.foot(stance), 0, Vector2d::Zero(), 0);
  std::optional<double> farthest;
  for (const balance::HalfPlane& place : places) {
    std::vector<Vector2d> support(standing.corners().begin(), standing.corners().end());
    for (const Vector2d& foothold : ClipHull(reached, place)) {
      const auto landed = stepping::SoleAt(choice.foot(foot), 0, foothold, 0);
      support.insert(support.end(), landed.corners().begin(), landed.corners().end());
    }
    const std::optional<double> distance = DistanceToEdge(support, start, way);
    if (distance) farthest = std::max(farthest.value_or(*distance), *distance);
  }
  return farthest;
}

}  // namespace poise
