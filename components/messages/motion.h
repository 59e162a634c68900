// Motions of points and frames, and their messages. Doubles go over unchanged, so that a reference
// is the same on both sides of the bus.
#pragma once

#include <Eigen/Core>

#include "components/framework/state_archive.h"
#include "poise/point_motion_t.hpp"
#include "poise/rotation_motion_t.hpp"

namespace poise {

/// Position, velocity and acceleration of a point, m and s; or of a rotation vector, rad and s.
struct PointMotion {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();

  void Archive(StateArchive* archive) { archive->Show(position, velocity, acceleration); }
};

/// How a frame turns, world axes.
struct RotationMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();          ///< frame to world
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();      ///< rad/s
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  ///< rad/s²

  void Archive(StateArchive* archive) {
    archive->Show(rotation, angular_velocity, angular_acceleration);
  }
};

void SetMotion(const PointMotion& motion, point_motion_t* message);
PointMotion GetMotion(const point_motion_t& message);
void SetMotion(const RotationMotion& motion, rotation_motion_t* message);
RotationMotion GetMotion(const rotation_motion_t& message);

}  // namespace poise
