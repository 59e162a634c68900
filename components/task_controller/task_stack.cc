#include "components/task_controller/task_stack.h"

#include <Eigen/Geometry>

namespace poise {
namespace {

Eigen::Vector3d Pd(const PdGains& gains, const Eigen::Vector3d& error,
                   const Eigen::Vector3d& velocity_error) {
  return gains.kp * error + gains.kd * velocity_error;
}

}  // namespace

Eigen::Vector3d OrientationError(const Eigen::Matrix3d& desired, const Eigen::Matrix3d& actual) {
  const Eigen::AngleAxisd rotation(desired * actual.transpose());
  return rotation.angle() * rotation.axis();
}

TaskStack::TaskStack(const robot::RobotModel& model, PdGains com, PdGains orientation, PdGains foot)
    : com_(com),
      orientation_(orientation),
      foot_(foot),
      jacobian_(Eigen::MatrixXd::Zero(kMaxRows, model.num_velocities())),
      bias_acceleration_(Eigen::VectorXd::Zero(kMaxRows)),
      acceleration_(Eigen::VectorXd::Zero(kMaxRows)) {
  // The body's angular Jacobian: columns of joints that do not carry it stay zero.
  jacobian_.block<3, 3>(3, 3).setIdentity();
}

void TaskStack::Update(const robot::RobotModel& model, const robot::RobotData& data,
                       const TaskReferences& references, const std::array<bool, 2>& in_contact) {
  jacobian_.topRows<3>() = data.com_jacobian;
  bias_acceleration_.head<3>() = data.com_bias_acceleration;
  acceleration_.head<3>() =
      references.com.acceleration +
      Pd(com_, references.com.position - data.com, references.com.velocity - data.com_velocity);

  const int body = model.body_task_body();
  const auto b = static_cast<size_t>(body);
  for (const int joint : model.supporting_joints(body)) {
    jacobian_.block<3, 1>(3, 6 + joint) = data.joint_axis[static_cast<size_t>(joint)];
  }
  body_error_ = OrientationError(references.body.rotation, data.body_rotation[b]);
  bias_acceleration_.segment<3>(3) = data.body_angular_bias[b];
  acceleration_.segment<3>(3) =
      references.body.angular_acceleration +
      Pd(orientation_, body_error_,
         references.body.angular_velocity - data.body_angular_velocity[b]);

  num_rows_ = 6;
  for (size_t i = 0; i < 2; ++i) {
    if (in_contact[i]) continue;
    const PointMotion& desired = references.foot[i];
    const RotationMotion& turn = references.foot_rotation[i];
    const Eigen::Isometry3d& sole = data.foot_pose[i];
    jacobian_.middleRows<6>(num_rows_) = data.foot_jacobian[i];
    bias_acceleration_.segment<6>(num_rows_) = data.foot_bias_acceleration[i];
    acceleration_.segment<3>(num_rows_) =
        desired.acceleration + Pd(foot_, desired.position - sole.translation(),
                                  desired.velocity - data.foot_velocity[i].head<3>());
    acceleration_.segment<3>(num_rows_ + 3) =
        turn.angular_acceleration + Pd(foot_, OrientationError(turn.rotation, sole.linear()),
                                       turn.angular_velocity - data.foot_velocity[i].tail<3>());
    num_rows_ += 6;
  }
}

}  // namespace poise
