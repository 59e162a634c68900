#include "components/robot/composite_dynamics.h"

namespace poise::robot {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void ComputeMassMatrix(const RobotModel& model, const RobotState& state, RobotData* data) {
  const KinematicTree& tree = model.tree();
  const Eigen::Index n = data->mass_matrix.rows();
  double* a = data->mass_matrix.data();
  for (size_t b = tree.bodies.size() - 1; b > 0; --b) {
    const RobotData::Subtree& body = data->subtree[b];
    RobotData::Subtree& parent = data->subtree[static_cast<size_t>(tree.bodies[b].parent)];
    const Eigen::Index j = static_cast<Eigen::Index>(b) + 5;
    // Momentum of everything the joint carries, at unit rate, about the base origin.
    const Vector3d& axis = data->joint_axis[b - 1];
    const Vector3d arm = data->body_position[b].cross(axis);
    const Vector3d linear = tree.bodies[b].subtree_mass * arm + axis.cross(body.first_moment);
    const Vector3d angular = body.first_moment.cross(arm) + SymmetricTimes(body.inertia, axis);
    a[j * n + j] = axis.dot(angular) + arm.dot(linear) + tree.joints[b - 1].reflected_inertia;
    for (int k = tree.bodies[b].parent; k > 0; k = tree.bodies[static_cast<size_t>(k)].parent) {
      const size_t s = static_cast<size_t>(k);
      const Vector3d& other = data->joint_axis[s - 1];
      const double value = other.dot(angular) + data->body_position[s].cross(other).dot(linear);
      a[j * n + k + 5] = value;
      a[(k + 5) * n + j] = value;
    }
    for (int i = 0; i < 3; ++i) {
      a[j * n + i] = a[i * n + j] = linear[i];
      a[j * n + 3 + i] = a[(3 + i) * n + j] = angular[i];
    }
    parent.first_moment += body.first_moment;
    parent.inertia += body.inertia;
  }
  const Vector3d& h = data->subtree[0].first_moment;
  const Matrix3d& inertia = data->subtree[0].inertia;
  for (int i = 0; i < 3; ++i) a[i * n + i] = data->total_mass;
  a[3 * n + 1] = a[1 * n + 3] = -h.z();
  a[3 * n + 2] = a[2 * n + 3] = h.y();
  a[4 * n + 0] = a[0 * n + 4] = h.z();
  a[4 * n + 2] = a[2 * n + 4] = -h.x();
  a[5 * n + 0] = a[0 * n + 5] = -h.y();
  a[5 * n + 1] = a[1 * n + 5] = h.x();
  for (int c = 0; c < 3; ++c) {
    for (int r = c; r < 3; ++r) {
      a[(3 + c) * n + 3 + r] = a[(3 + r) * n + 3 + c] = inertia(r, c);
    }
  }

  const double inverse_mass = 1 / data->total_mass;
  data->com = data->base_position + inverse_mass * h;
  Vector3d velocity =
      state.base_linear_velocity + state.base_angular_velocity.cross(inverse_mass * h);
  double* jacobian = data->com_jacobian.data();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (int r = 0; r < 3; ++r) jacobian[3 * i + r] = inverse_mass * a[i * n + r];
  }
  for (Eigen::Index j = 6; j < n; ++j) {
    velocity += data->com_jacobian.col(j) * state.joint_velocity[j - 6];
  }
  data->com_velocity = velocity;
}

}  // namespace poise::robot
