// Poses, velocities and velocity-product accelerations; Jacobians of points.
#include <cmath>

#include "components/robot/dynamics.h"

namespace poise::robot {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Sets one joint's linear (0..2) and angular (3..5) rows of a column-major 6×n matrix.
inline void SetColumn(double* column, const Vector3d& linear, const Vector3d& angular) {
  column[0] = linear.x();
  column[1] = linear.y();
  column[2] = linear.z();
  column[3] = angular.x();
  column[4] = angular.y();
  column[5] = angular.z();
}

// Base columns [1, -[r]ₓ; 0, 1] and the joints' columns [a × (r - p); a] of a point r carried by
// `body`.
inline void FillJacobian(const RobotModel& model, const RobotData& data, int body,
                         const Vector3d& point, double* jacobian, Eigen::Index stride) {
  for (int k = 0; k < 3; ++k) {
    SetColumn(jacobian + k * stride, Vector3d::Unit(k), Vector3d::Zero());
    SetColumn(jacobian + (3 + k) * stride, Vector3d::Unit(k).cross(point), Vector3d::Unit(k));
  }
  for (const int joint : model.supporting_joints(body)) {
    const size_t j = static_cast<size_t>(joint);
    const Vector3d& axis = data.joint_axis[j];
    SetColumn(jacobian + (6 + joint) * stride, axis.cross(point - data.body_position[j + 1]), axis);
  }
}

}  // namespace

void ComputeKinematics(const RobotModel& model, const RobotState& state, RobotData* data) {
  const KinematicTree& tree = model.tree();
  data->base_position = state.base_position;
  data->body_rotation[0] = state.base_orientation.toRotationMatrix();
  data->body_position[0].setZero();
  data->body_angular_velocity[0] = state.base_angular_velocity;
  data->body_linear_velocity[0] = state.base_linear_velocity;
  data->body_angular_bias[0].setZero();
  data->body_linear_bias[0].setZero();
  const double* position = state.joint_position.data();
  const double* velocity = state.joint_velocity.data();
  for (size_t j = 0; j < tree.joints.size(); ++j) {
    const KinematicTree::JointTransform& joint = tree.joints[j];
    const size_t b = j + 1;
    const size_t p = static_cast<size_t>(tree.bodies[b].parent);
    const double s = std::sin(position[j]), c = std::cos(position[j]);
    const Matrix3d local = joint.constant + c * joint.cosine + s * joint.sine;
    const Matrix3d& parent = data->body_rotation[p];
    data->body_rotation[b].noalias() = parent * local;
    const Vector3d axis = parent * joint.axis;
    const Vector3d offset = parent * joint.offset;
    const Vector3d& w = data->body_angular_velocity[p];
    const Vector3d& alpha = data->body_angular_bias[p];
    const Vector3d spin = axis * velocity[j];
    const Vector3d sweep = w.cross(offset);
    data->joint_axis[j] = axis;
    data->body_position[b] = data->body_position[p] + offset;
    data->body_angular_velocity[b] = w + spin;
    data->body_linear_velocity[b] = data->body_linear_velocity[p] + sweep;
    data->body_angular_bias[b] = alpha + w.cross(spin);
    data->body_linear_bias[b] = data->body_linear_bias[p] + alpha.cross(offset) + w.cross(sweep);
  }
}

void ComputeFeet(const RobotModel& model, RobotData* data) {
  for (const Foot f : kFeet) {
    const FootModel& foot = model.feet()[f];
    const size_t b = static_cast<size_t>(foot.body);
    const Matrix3d& rotation = data->body_rotation[b];
    const Vector3d arm = rotation * foot.sole.translation();
    const Vector3d point = data->body_position[b] + arm;
    const Vector3d& w = data->body_angular_velocity[b];
    const Vector3d& alpha = data->body_angular_bias[b];
    data->foot_pose[f].linear().noalias() = rotation * foot.sole.linear();
    data->foot_pose[f].translation() = data->base_position + point;
    const Vector3d sweep = w.cross(arm);
    data->foot_velocity[f] << data->body_linear_velocity[b] + sweep, w;
    data->foot_bias_acceleration[f]
        << data->body_linear_bias[b] + alpha.cross(arm) + w.cross(sweep),
        alpha;
    FillJacobian(model, *data, foot.body, point, data->foot_jacobian[f].data(), 6);
  }
}

void ComputePointJacobian(const RobotModel& model, const RobotData& data, int body,
                          const Eigen::Vector3d& point, Eigen::Ref<Matrix6X> jacobian) {
  const size_t b = static_cast<size_t>(body);
  jacobian.setZero();
  FillJacobian(model, data, body, data.body_position[b] + data.body_rotation[b] * point,
               jacobian.data(), jacobian.outerStride());
}

}  // namespace poise::robot
