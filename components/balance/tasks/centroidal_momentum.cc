#include "components/balance/tasks/centroidal_momentum.h"

namespace poise::balance {

using Eigen::Vector3d;

void ComputeAngularMomentumRows(const robot::RobotData& data, Eigen::Ref<Eigen::MatrixXd> jacobian,
                                Vector3d* bias) {
  const Vector3d arm = data.com - data.base_position;
  for (Eigen::Index j = 0; j < data.mass_matrix.cols(); ++j) {
    const Vector3d force = data.mass_matrix.block<3, 1>(0, j);
    jacobian.block<3, 1>(0, j) = data.mass_matrix.block<3, 1>(3, j) - arm.cross(force);
  }
  *bias = data.bias.segment<3>(3) - arm.cross(data.bias.head<3>());
}

Vector3d AngularMomentum(const robot::RobotState& state, const robot::RobotData& data) {
  const Vector3d arm = data.com - data.base_position;
  Vector3d momentum = Vector3d::Zero(), about_base = Vector3d::Zero();
  const auto add = [&](Eigen::Index column, double rate) {
    momentum += data.mass_matrix.block<3, 1>(0, column) * rate;
    about_base += data.mass_matrix.block<3, 1>(3, column) * rate;
  };
  for (int axis = 0; axis < 3; ++axis) {
    add(axis, state.base_linear_velocity[axis]);
    add(3 + axis, state.base_angular_velocity[axis]);
  }
  for (Eigen::Index j = 0; j < state.joint_velocity.size(); ++j) {
    add(6 + j, state.joint_velocity[j]);
  }
  return about_base - arm.cross(momentum);
}

}  // namespace poise::balance
