// Mass, centre of mass and inertia of links fixed to each other.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace poise::robot {

struct MassProperties {
  double mass = 0;                                    ///< kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();      ///< m
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< kg·m², about the COM
};

/// The same body seen from another frame: `pose` is the present frame in the new one.
MassProperties Transformed(const MassProperties& part, const Eigen::Isometry3d& pose);

/// One rigid body made of parts, all in one frame (parallel-axis theorem). Massless parts count
/// with their inertia.
MassProperties Merged(const std::vector<MassProperties>& parts);

/// What makes these properties impossible for a part, with the figures; empty when they are
/// possible. A part may be massless or a point.
std::string WhyImpossible(const MassProperties& part);

/// WhyImpossible of a body that moves: it takes positive mass and positive definite inertia.
std::string WhyImmovable(const MassProperties& body);

}  // namespace poise::robot
