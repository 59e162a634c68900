// Motion of any frame of a robot.
#pragma once

#include <Eigen/Geometry>

#include "components/robot/dynamics.h"

namespace poise::balance {

/// How a frame's origin moves: world axes, linear over angular.
struct FrameMotion {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();       ///< in the world
  robot::Vector6d velocity = robot::Vector6d::Zero();           ///< m/s, rad/s
  robot::Vector6d bias_acceleration = robot::Vector6d::Zero();  ///< J̇ v: m/s², rad/s²
};

/// Requires ComputeKinematics in `data`.
FrameMotion ComputeFrameMotion(const robot::RobotData& data, const robot::Frame& frame);

/// Jacobian (6×n, linear over angular, world axes) of the frame's origin. Fills the base's columns
/// and those of the joints that carry the frame; the others must be zero already. Requires
/// ComputeKinematics in `data`.
void FillFrameJacobian(const robot::RobotModel& model, const robot::RobotData& data,
                       const robot::Frame& frame, Eigen::Ref<Eigen::MatrixXd> jacobian);

}  // namespace poise::balance
