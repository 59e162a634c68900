// The robot's dynamics with its contacts at one state, computed once for everybody who asks in one
// process.
#pragma once

#include <array>
#include <memory>

#include "components/balance/balance_control.h"
#include "components/balance/contact_dynamics.h"
#include "components/robot/dynamics.h"

namespace poise::balance {

/// Contact dynamics of a robot that stands on its feet.
ContactDynamics MakeContactDynamics(const robot::RobotModel& model);

/// Kinematics, dynamics and contact dynamics of a state. A pure function of its arguments: asking
/// again with equal arguments costs a comparison, so components of one process may share one
/// object. Never allocates after construction.
class WholeBody {
 public:
  explicit WholeBody(std::shared_ptr<const robot::RobotModel> model);

  /// Kinematics and feet only (data().foot_*). Enough for redistribution. `state` sized for the
  /// model.
  void UpdateKinematics(const robot::RobotState& state);
  /// Those, mass matrix and COM, whatever the contacts: enough for data(), contact() is not valid.
  void UpdateDynamics(const robot::RobotState& state);
  /// Everything, for the given contacts. False when the contact dynamics do not exist
  /// (non-finite state, feet in a singular posture, no contact).
  bool Update(const robot::RobotState& state, const FootArray<bool>& in_contact);

  const robot::RobotModel& model() const { return *model_; }
  const robot::RobotData& data() const { return data_; }
  const ContactDynamics& contact() const { return contact_; }  ///< valid after Update returned true
  /// About the COM, kg·m²/s, world axes, of the last Update's or UpdateDynamics' state.
  Eigen::Vector3d AngularMomentum() const;
  /// Sole frames and contacts of the last Update.
  ContactGeometry geometry() const;
  /// J_c (6 per contact) in sole axes for the given contacts, from data(): rows [force; moment]
  /// right first. `jacobian` is resized when it does not have the right size already.
  void ContactJacobian(const FootArray<bool>& in_contact, Eigen::MatrixXd* jacobian) const;

 private:
  bool UpdateContacts();

  std::shared_ptr<const robot::RobotModel> model_;
  robot::RobotData data_;
  ContactDynamics contact_;
  robot::RobotState state_;
  FootArray<bool> in_contact_{false, false};
  bool have_kinematics_ = false, have_dynamics_ = false, have_contacts_ = false;
  bool contacts_valid_ = false;
  std::array<Eigen::MatrixXd, 2> contact_jacobian_;  // 6×n for one foot, 12×n for two
  Eigen::VectorXd contact_bias_;
};

}  // namespace poise::balance
