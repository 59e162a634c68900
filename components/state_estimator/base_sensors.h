// What the estimators read.
#pragma once

#include <Eigen/Core>
#include <array>

namespace poise {

/// Readings of one instant. Views: nothing is copied.
struct BaseSensors {
  Eigen::Map<const Eigen::VectorXd> joint_position;  ///< rad
  Eigen::Vector3d angular_velocity;                  ///< rad/s, IMU frame
  Eigen::Vector3d acceleration;                      ///< m/s², IMU frame, specific force
  std::array<double, 2> foot_load;  ///< N, upward force on the sole (−F_z), right first
  /// m, centre of pressure in the sole's frame; of no meaning without load.
  std::array<Eigen::Vector2d, 2> foot_cop = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  /// N·m, of the motors at the joints; empty: not measured.
  Eigen::Map<const Eigen::VectorXd> joint_torque{nullptr, 0};
};

}  // namespace poise
