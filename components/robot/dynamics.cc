#include "components/robot/dynamics.h"

#include "components/robot/composite_dynamics.h"

namespace poise::robot {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// R I Rᵀ, lower triangle only.
inline Matrix3d RotatedInertia(const Matrix3d& r, const Matrix3d& inertia) {
  const Matrix3d t = r * inertia;
  Matrix3d w;
  for (int c = 0; c < 3; ++c) {
    for (int row = c; row < 3; ++row) {
      w(row, c) = t(row, 0) * r(c, 0) + t(row, 1) * r(c, 1) + t(row, 2) * r(c, 2);
    }
  }
  return w;
}

// The load moves with the base; its inertia about its own centre is not known and left out.
void AddLoad(const RobotState& state, RobotData* data) {
  RobotData::Subtree& base = data->subtree[0];
  const Vector3d moment = data->body_rotation[0] * state.load_moment;
  const Vector3d& w = data->body_angular_velocity[0];
  const Vector3d force = w.cross(w.cross(moment));
  base.first_moment += moment;
  base.force += force;
  if (!(state.load_mass > 0)) return;  // a moment without mass has no inertia
  const Vector3d place = moment / state.load_mass;
  base.moment += place.cross(force);
  const double square = place.dot(moment);
  for (int c = 0; c < 3; ++c) {
    for (int row = c; row < 3; ++row) base.inertia(row, c) -= place[row] * moment[c];
    base.inertia(c, c) += square;
  }
}

}  // namespace

RobotData::RobotData(const RobotModel& model)
    : body_rotation(model.bodies().size(), Matrix3d::Identity()),
      body_position(model.bodies().size(), Vector3d::Zero()),
      joint_axis(model.joints().size(), Vector3d::UnitZ()),
      body_angular_velocity(model.bodies().size(), Vector3d::Zero()),
      body_linear_velocity(model.bodies().size(), Vector3d::Zero()),
      body_angular_bias(model.bodies().size(), Vector3d::Zero()),
      body_linear_bias(model.bodies().size(), Vector3d::Zero()),
      base_position(Vector3d::Zero()),
      foot_pose(Eigen::Isometry3d::Identity()),
      // Columns of joints off a foot's path and entries of A between joints of different limbs stay
      // zero.
      foot_jacobian(Matrix6X::Zero(6, model.num_velocities())),
      foot_velocity(Vector6d::Zero()),
      foot_bias_acceleration(Vector6d::Zero()),
      mass_matrix(Eigen::MatrixXd::Zero(model.num_velocities(), model.num_velocities())),
      bias(Eigen::VectorXd::Zero(model.num_velocities())),
      gravity(Eigen::VectorXd::Zero(model.num_velocities())),
      com(Vector3d::Zero()),
      com_velocity(Vector3d::Zero()),
      com_jacobian(Eigen::Matrix<double, 3, Eigen::Dynamic>::Zero(3, model.num_velocities())),
      com_bias_acceleration(Vector3d::Zero()),
      subtree(model.bodies().size()) {}

void ComputeDynamics(const RobotModel& model, const RobotState& state, RobotData* data) {
  const KinematicTree& tree = model.tree();
  for (size_t b = 0; b < tree.bodies.size(); ++b) {
    const KinematicTree::BodyMass& body = tree.bodies[b];
    RobotData::Subtree& out = data->subtree[b];
    const Matrix3d& rotation = data->body_rotation[b];
    const Vector3d arm = rotation * body.com;
    const Vector3d com = data->body_position[b] + arm;
    const Vector3d& w = data->body_angular_velocity[b];
    const Vector3d& alpha = data->body_angular_bias[b];
    const Matrix3d inertia = RotatedInertia(rotation, body.inertia);
    out.first_moment = body.mass * com;
    out.force = body.mass * (data->body_linear_bias[b] + alpha.cross(arm) + w.cross(w.cross(arm)));
    out.moment =
        com.cross(out.force) + SymmetricTimes(inertia, alpha) + w.cross(SymmetricTimes(inertia, w));
    const Vector3d& h = out.first_moment;
    const double square = com.dot(h);
    out.inertia(0, 0) = inertia(0, 0) + square - com.x() * h.x();
    out.inertia(1, 0) = inertia(1, 0) - com.y() * h.x();
    out.inertia(2, 0) = inertia(2, 0) - com.z() * h.x();
    out.inertia(1, 1) = inertia(1, 1) + square - com.y() * h.y();
    out.inertia(2, 1) = inertia(2, 1) - com.z() * h.y();
    out.inertia(2, 2) = inertia(2, 2) + square - com.z() * h.z();
  }
  data->total_mass = model.total_mass() + state.load_mass;
  if (state.load_mass != 0 || !state.load_moment.isZero(0)) AddLoad(state, data);
  ComputeMassMatrix(model, state, data);
  ComputeBias(model, data);
}

void InverseDynamics(const RobotModel& model, const RobotState& state, const RobotData& data,
                     const Eigen::Ref<const Eigen::VectorXd>& acceleration,
                     Eigen::Ref<Eigen::VectorXd> generalized_force) {
  static_cast<void>(state);
  generalized_force.setZero();
  const Vector3d base_linear = acceleration.head<3>();
  const Vector3d base_angular = acceleration.segment<3>(3);
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const Body& body = model.bodies()[b];
    const Matrix3d& rotation = data.body_rotation[b];
    const Vector3d com = data.body_position[b] + rotation * body.com;
    const Vector3d arm = com - data.body_position[b];
    const Vector3d& w = data.body_angular_velocity[b];
    Vector3d alpha = data.body_angular_bias[b] + base_angular;
    Vector3d linear = data.body_linear_bias[b] + data.body_angular_bias[b].cross(arm) +
                      w.cross(w.cross(arm)) + base_linear + base_angular.cross(com);
    for (const int joint : model.supporting_joints(static_cast<int>(b))) {
      const size_t j = static_cast<size_t>(joint);
      const Vector3d spin = data.joint_axis[j] * acceleration[6 + joint];
      alpha += spin;
      linear += spin.cross(com - data.body_position[j + 1]);
    }
    const Vector3d force = body.mass * (linear + Vector3d(0, 0, kGravity));
    const Vector3d body_w = rotation.transpose() * w;
    const Vector3d moment =  // Euler's equation in the body's own axes
        rotation *
        (body.inertia * (rotation.transpose() * alpha) + body_w.cross(body.inertia * body_w));
    generalized_force.head<3>() += force;
    generalized_force.segment<3>(3) += moment + com.cross(force);
    for (const int joint : model.supporting_joints(static_cast<int>(b))) {
      const size_t j = static_cast<size_t>(joint);
      generalized_force[6 + joint] +=
          data.joint_axis[j].dot(moment + (com - data.body_position[j + 1]).cross(force));
    }
  }
  for (int j = 0; j < model.num_joints(); ++j) {
    generalized_force[6 + j] +=
        model.motors()[static_cast<size_t>(j)].reflected_inertia * acceleration[6 + j];
  }
}

RobotData Evaluate(const RobotModel& model, const RobotState& state) {
  RobotData data(model);
  ComputeKinematics(model, state, &data);
  ComputeFeet(model, &data);
  ComputeDynamics(model, state, &data);
  return data;
}

RobotData Evaluate(const RobotModel& model, const Eigen::VectorXd& joint_position) {
  RobotState state(model.num_joints());
  state.joint_position = joint_position;
  return Evaluate(model, state);
}

}  // namespace poise::robot
