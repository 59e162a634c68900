// The flat that a foot stands on, from its shapes.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "components/robot/robot_source.h"

namespace poise {

/// A shape of a foot, in the frame of its body. `points`: of a mesh.
struct FootShape {
  robot::SourceShape::Kind kind = robot::SourceShape::Kind::kBox;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points;  ///< in the body
};

struct FoundSole {
  /// In the body: origin in the middle of the polygon, z out of the ground, x forward.
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector2d> polygon;  ///< m, sole frame, convex, counter-clockwise
};

/// Points of the shapes that can touch a plane below them, `down` a unit vector of the body.
std::vector<Eigen::Vector3d> LowPoints(std::span<const FootShape> shapes,
                                       const Eigen::Vector3d& down);

/// The face on which the foot rests when set down about as `down` says (it may tilt up to 30°),
/// with x along `forward`. An empty polygon when the lowest points span no area.
FoundSole FindSole(std::span<const FootShape> shapes, const Eigen::Vector3d& down,
                   const Eigen::Vector3d& forward);

}  // namespace poise
