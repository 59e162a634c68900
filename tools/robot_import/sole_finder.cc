#include "tools/robot_import/sole_finder.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "components/robot/sole.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Kind = robot::SourceShape::Kind;

constexpr int kCircle = 24;  // points of a cylinder's rim
// m: what lies this much above the lowest point still touches: first while the face is sought, then
// what rubber and rounding even out.
constexpr std::array kBands = {0.012, 0.006, 0.002, 0.002};
constexpr double kMostTilt = 0.5;       // rad
constexpr double kLeastArea = 4e-4;     // m²
constexpr double kLeastSpread = 0.005;  // m, of points that define a plane, across
constexpr size_t kMostVertices = 12;

double Area(const std::vector<Vector2d>& polygon) {
  double area = 0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return area;
}

/// Where the sole frame's origin lies: in the middle of the polygon's box, or in its centroid where
/// that middle is near an edge, as a triangle's may be.
Vector2d Middle(const std::vector<Vector2d>& polygon) {
  Eigen::AlignedBox2d box;
  Vector2d centroid = Vector2d::Zero();
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    box.extend(a);
    centroid += (a.x() * b.y() - a.y() * b.x()) * (a + b) / (6 * Area(polygon));
  }
  robot::FootModel foot;
  foot.vertices = polygon;
  const double inside = robot::DistanceInside(foot, box.center());
  return inside > 0.5 * robot::DistanceInside(foot, centroid) ? box.center() : centroid;
}

/// Normal of the least-squares plane, towards `down`; zero where the points lie on a line.
Vector3d PlaneNormal(const std::vector<Vector3d>& points, const Vector3d& down) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& p : points) {
    spread += (p - mean) * (p - mean).transpose() / static_cast<double>(points.size());
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(spread);
  if (std::sqrt(std::max(0.0, solver.eigenvalues()[1])) < kLeastSpread) return Vector3d::Zero();
  const Vector3d normal = solver.eigenvectors().col(0);
  return normal.dot(down) < 0 ? Vector3d(-normal) : normal;
}

/// What is down after the foot, which touches with a corner or an edge, has rolled over it by the
/// least angle that lets another point touch; zero where there is none.
Vector3d Rolled(const std::vector<Vector3d>& points, const std::vector<Vector3d>& touching,
                const Vector3d& down) {
  Vector3d pivot = touching.front();
  for (const Vector3d& p : touching) {
    if (p.dot(down) > pivot.dot(down)) pivot = p;
  }
  Vector3d along = Vector3d::Zero();  // the edge: to the touching point that is farthest away
  for (const Vector3d& p : touching) {
    if ((p - pivot).norm() > along.norm()) along = p - pivot;
  }
  const bool edge = along.norm() > 2 * kLeastSpread;
  along.normalize();
  Vector3d rolled = Vector3d::Zero();
  double least = std::numbers::pi / 2;
  for (const Vector3d& p : points) {
    const Vector3d reach = p - pivot;
    Vector3d across = reach - reach.dot(down) * down;
    if (edge) across -= across.dot(along) * along;
    if (across.norm() < 2 * kLeastSpread) continue;
    const double angle = std::atan2(-reach.dot(down), across.norm());
    if (angle >= least) continue;
    least = angle;
    const Vector3d axis = edge ? along : Vector3d(across.cross(down).normalized());
    const Vector3d normal = axis.cross(reach).normalized();
    rolled = normal.dot(down) < 0 ? Vector3d(-normal) : normal;
  }
  return rolled;
}

}  // namespace

std::vector<Vector3d> LowPoints(std::span<const FootShape> shapes, const Vector3d& down) {
  std::vector<Vector3d> points;
  for (const FootShape& shape : shapes) {
    const Vector3d axis = shape.pose.linear().col(2);
    const Vector3d centre = shape.pose.translation();
    const double radius = shape.size.x();
    const Vector3d half = 0.5 * shape.size.y() * axis;
    switch (shape.kind) {
      case Kind::kBox:
        for (int c = 0; c < 8; ++c) {
          const Vector3d corner(c & 1 ? 0.5 : -0.5, c & 2 ? 0.5 : -0.5, c & 4 ? 0.5 : -0.5);
          points.push_back(shape.pose * corner.cwiseProduct(shape.size));
        }
        break;
      case Kind::kSphere:
        points.push_back(centre + radius * down);
        break;
      case Kind::kCapsule:
        points.push_back(centre + half + radius * down);
        points.push_back(centre - half + radius * down);
        break;
      case Kind::kCylinder: {
        for (int i = 0; i < kCircle; ++i) {
          const double angle = 2 * std::numbers::pi * i / kCircle;
          const Vector3d rim =
              shape.pose.linear() * Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0);
          points.push_back(centre + half + rim);
          points.push_back(centre - half + rim);
        }
        const Vector3d across = down - down.dot(axis) * axis;
        if (across.norm() < 1e-3) break;
        points.push_back(centre + half + radius * across.normalized());
        points.push_back(centre - half + radius * across.normalized());
        break;
      }
      case Kind::kMesh:
        points.insert(points.end(), shape.points.begin(), shape.points.end());
        break;
    }
  }
  return points;
}

FoundSole FindSole(std::span<const FootShape> shapes, const Vector3d& down,
                   const Vector3d& forward) {
  Vector3d normal = down.normalized();
  std::vector<Vector3d> touching;
  for (const double band : kBands) {
    const std::vector<Vector3d> points = LowPoints(shapes, normal);
    double lowest = -1e9;
    for (const Vector3d& p : points) lowest = std::max(lowest, p.dot(normal));
    touching.clear();
    for (const Vector3d& p : points) {
      if (p.dot(normal) > lowest - band) touching.push_back(p);
    }
    if (touching.empty()) return {};
    Vector3d better = PlaneNormal(touching, normal);
    if (better.isZero()) better = Rolled(points, touching, normal);
    if (better.isZero() || better.dot(down.normalized()) < std::cos(kMostTilt)) continue;
    normal = better;
  }
  FoundSole sole;
  const Vector3d up = -normal;
  const Vector3d x = (forward - forward.dot(up) * up).normalized();
  sole.frame.linear().col(0) = x;
  sole.frame.linear().col(1) = up.cross(x);
  sole.frame.linear().col(2) = up;
  double lowest = -1e9;
  for (const Vector3d& p : touching) lowest = std::max(lowest, p.dot(normal));
  std::vector<Vector2d> flat;
  for (const Vector3d& p : touching) {
    flat.emplace_back(p.dot(x), p.dot(sole.frame.linear().col(1)));
  }
  sole.polygon = robot::SoleOutline(std::move(flat), kMostVertices);
  if (sole.polygon.size() < 3 || Area(sole.polygon) < kLeastArea) {
    sole.polygon.clear();
    return sole;
  }
  const Vector2d centre = Middle(sole.polygon);
  for (Vector2d& p : sole.polygon) p -= centre;
  sole.frame.translation() = sole.frame.linear() * Vector3d(centre.x(), centre.y(), -lowest);
  return sole;
}

}  // namespace poise
