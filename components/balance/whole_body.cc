#include "components/balance/whole_body.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

namespace poise::balance {
namespace {

bool Same(const robot::RobotState& a, const robot::RobotState& b) {
  return a.base_position == b.base_position &&
         a.base_orientation.coeffs() == b.base_orientation.coeffs() &&
         a.base_linear_velocity == b.base_linear_velocity &&
         a.base_angular_velocity == b.base_angular_velocity &&
         a.joint_position == b.joint_position && a.joint_velocity == b.joint_velocity &&
         a.load_mass == b.load_mass && a.load_moment == b.load_moment;
}

/// Joints between the base and a foot, ascending.
std::vector<int> LegJoints(const robot::RobotModel& model) {
  std::set<int> legs;
  for (const robot::FootModel& foot : model.feet()) {
    const auto joints = model.supporting_joints(foot.body);
    legs.insert(joints.begin(), joints.end());
  }
  return {legs.begin(), legs.end()};
}

/// Another joint hangs on a leg: toes, or arms above a waist that the feet stand below.
bool LegsCarryOthers(const robot::RobotModel& model) {
  const std::vector<int> legs = LegJoints(model);
  const auto is_leg = [&](int joint) { return std::ranges::binary_search(legs, joint); };
  for (const robot::Joint& joint : model.joints()) {
    const auto below = model.supporting_joints(joint.body);
    if (!is_leg(below.front()) && std::ranges::any_of(below, is_leg)) return true;
  }
  return false;
}

}  // namespace

ContactDynamics MakeContactDynamics(const robot::RobotModel& model) {
  return ContactDynamics(model.num_joints(), LegJoints(model), LegsCarryOthers(model));
}

WholeBody::WholeBody(std::shared_ptr<const robot::RobotModel> model)
    : model_(std::move(model)),
      data_(*model_),
      contact_(MakeContactDynamics(*model_)),
      state_(model_->num_joints()) {
  contact_jacobian_[0].setZero(6, model_->num_velocities());
  contact_jacobian_[1].setZero(12, model_->num_velocities());
  contact_bias_.setZero(12);
}

void WholeBody::UpdateKinematics(const robot::RobotState& state) {
  if (have_kinematics_ && Same(state, state_)) return;
  state_ = state;
  have_kinematics_ = true;
  have_dynamics_ = have_contacts_ = false;
  robot::ComputeKinematics(*model_, state_, &data_);
  robot::ComputeFeet(*model_, &data_);
}

void WholeBody::UpdateDynamics(const robot::RobotState& state) {
  UpdateKinematics(state);
  if (have_dynamics_) return;
  robot::ComputeDynamics(*model_, state_, &data_);
  have_dynamics_ = true;
}

bool WholeBody::Update(const robot::RobotState& state, const FootArray<bool>& in_contact) {
  UpdateDynamics(state);
  if (!have_contacts_ || in_contact != in_contact_) {
    in_contact_ = in_contact;
    contacts_valid_ = UpdateContacts();
    have_contacts_ = true;
  }
  return contacts_valid_;
}

bool WholeBody::UpdateContacts() {
  const int contacts = Count(in_contact_);
  // A quaternion of zero length would pass for an upright base.
  if (contacts == 0 || !(std::abs(state_.base_orientation.squaredNorm() - 1) < 1e-6)) return false;
  Eigen::MatrixXd& jacobian = contact_jacobian_[static_cast<size_t>(contacts) - 1];
  ContactJacobian(in_contact_, &jacobian);
  int row = 0;
  for (const Foot foot : kFeet) {
    if (!in_contact_[foot]) continue;
    // The sole stands still, so that turning J̇ v into its axes is all that its rotation asks for.
    const auto to_sole = data_.foot_pose[foot].linear().transpose();
    contact_bias_.segment<3>(row) = to_sole * data_.foot_bias_acceleration[foot].head<3>();
    contact_bias_.segment<3>(row + 3) = to_sole * data_.foot_bias_acceleration[foot].tail<3>();
    row += 6;
  }
  return contact_.Compute(data_.mass_matrix, data_.bias, data_.gravity, jacobian,
                          contact_bias_.head(6 * contacts));
}

Eigen::Vector3d WholeBody::AngularMomentum() const {
  // The base's rows of A v are the momentum about the base's origin.
  const Eigen::MatrixXd& mass = data_.mass_matrix;
  Eigen::Vector3d about_base = mass.block<3, 3>(3, 0) * state_.base_linear_velocity;
  about_base += mass.block<3, 3>(3, 3) * state_.base_angular_velocity;
  for (Eigen::Index j = 0; j < state_.joint_velocity.size(); ++j) {
    about_base += mass.block<3, 1>(3, 6 + j) * state_.joint_velocity[j];
  }
  return about_base -
         (data_.com - data_.base_position).cross(data_.total_mass * data_.com_velocity);
}

ContactGeometry WholeBody::geometry() const { return {data_.foot_pose, in_contact_}; }

void WholeBody::ContactJacobian(const FootArray<bool>& in_contact,
                                Eigen::MatrixXd* jacobian) const {
  const Eigen::Index n = model_->num_velocities();
  const Eigen::Index rows = 6 * Count(in_contact);
  jacobian->setZero(rows, n);  // columns of joints that are no leg's
  Eigen::Index row = 0;
  for (const Foot foot : kFeet) {
    if (!in_contact[foot]) continue;
    const Eigen::Matrix3d to_sole = data_.foot_pose[foot].linear().transpose();
    const robot::Matrix6X& world = data_.foot_jacobian[foot];
    const auto turn = [&](Eigen::Index j) {
      jacobian->block<3, 1>(row, j) = to_sole * world.block<3, 1>(0, j);
      jacobian->block<3, 1>(row + 3, j) = to_sole * world.block<3, 1>(3, j);
    };
    for (Eigen::Index j = 0; j < 6; ++j) turn(j);
    for (const int joint : contact_.legs()) turn(6 + joint);
    row += 6;
  }
}

}  // namespace poise::balance
