#include "components/robot/composite_dynamics.h"

namespace poise::robot {

using Eigen::Vector3d;

void ComputeBias(const RobotModel& model, RobotData* data) {
  const KinematicTree& tree = model.tree();
  for (size_t b = tree.bodies.size() - 1; b > 0; --b) {
    const RobotData::Subtree& body = data->subtree[b];
    RobotData::Subtree& parent = data->subtree[static_cast<size_t>(tree.bodies[b].parent)];
    const Vector3d& axis = data->joint_axis[b - 1];
    data->bias[static_cast<Eigen::Index>(b) + 5] =
        axis.dot(body.moment - data->body_position[b].cross(body.force));
    parent.force += body.force;
    parent.moment += body.moment;
  }
  data->bias.head<3>() = data->subtree[0].force;
  data->bias.segment<3>(3) = data->subtree[0].moment;
  data->com_bias_acceleration = data->subtree[0].force / data->total_mass;
  // Gravity does work through the height of the COM alone: g = m g J_com,z.
  data->gravity = kGravity * data->mass_matrix.col(2);
}

}  // namespace poise::robot
