// What the estimator reads.
#pragma once

#include <Eigen/Core>

#include "components/robot/foot.h"

namespace poise {

/// Readings of one instant. Views: nothing is copied.
struct BaseSensors {
  Eigen::Map<const Eigen::VectorXd> joint_position;  ///< rad
  Eigen::Vector3d angular_velocity;                  ///< rad/s, IMU frame
  Eigen::Vector3d acceleration;                      ///< m/s², IMU frame, specific force
  robot::FootArray<double> foot_load;                ///< N, upward force on the sole (−F_z)
  /// m, centre of pressure in the sole's frame; of no meaning without load.
  robot::FootArray<Eigen::Vector2d> foot_cop{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  /// N·m, of the motors at the joints; empty: not measured.
  Eigen::Map<const Eigen::VectorXd> joint_torque{nullptr, 0};
};

}  // namespace poise
