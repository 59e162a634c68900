#include "components/balance/tasks/frame_kinematics.h"

namespace poise::balance {

using Eigen::Vector3d;

FrameMotion ComputeFrameMotion(const robot::RobotData& data, const robot::Frame& frame) {
  const auto b = static_cast<size_t>(frame.body);
  const Eigen::Matrix3d& rotation = data.body_rotation[b];
  const Vector3d arm = rotation * frame.pose.translation();
  const Vector3d& w = data.body_angular_velocity[b];
  const Vector3d& alpha = data.body_angular_bias[b];
  const Vector3d sweep = w.cross(arm);
  FrameMotion motion;
  motion.pose.linear().noalias() = rotation * frame.pose.linear();
  const Vector3d point = data.body_position[b] + arm;
  motion.pose.translation() = data.base_position + point;
  motion.velocity << data.body_linear_velocity[b] + sweep, w;
  motion.bias_acceleration << data.body_linear_bias[b] + alpha.cross(arm) + w.cross(sweep), alpha;
  return motion;
}

void FillFrameJacobian(const robot::RobotModel& model, const robot::RobotData& data,
                       const robot::Frame& frame, Eigen::Ref<Eigen::MatrixXd> jacobian) {
  const auto b = static_cast<size_t>(frame.body);
  const Vector3d arm = data.body_rotation[b] * frame.pose.translation();
  const Vector3d point = data.body_position[b] + arm;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d unit = Vector3d::Unit(axis);
    jacobian.block<3, 1>(0, axis) = unit;
    jacobian.block<3, 1>(3, axis).setZero();
    jacobian.block<3, 1>(0, 3 + axis) = unit.cross(point);
    jacobian.block<3, 1>(3, 3 + axis) = unit;
  }
  for (const int joint : model.supporting_joints(frame.body)) {
    const auto j = static_cast<size_t>(joint);
    const Vector3d& axis = data.joint_axis[j];
    jacobian.block<3, 1>(0, 6 + joint) = axis.cross(point - data.body_position[j + 1]);
    jacobian.block<3, 1>(3, 6 + joint) = axis;
  }
}

}  // namespace poise::balance
