// The robot's dynamics with its contacts at one state, computed once for everybody who asks in one process.
#pragma once

#include <array>
#include <memory>

#include "components/balance/balance_control.h"
#include "components/balance/contact_dynamics.h"
#include "components/robot/dynamics.h"

namespace poise::balance {

/// Kinematics, dynamics and contact dynamics of a state. A pure function of its arguments: asking again with equal
/// arguments costs a comparison, so components of one process may share one object. Never allocates after construction.
class WholeBody {
 public:
  explicit WholeBody(std::shared_ptr<const robot::RobotModel> model);

  /// Kinematics and feet only (data().foot_*). Enough for redistribution.
  void UpdateKinematics(const robot::RobotState& state);
  /// Everything, for the given contacts (right first, at least one). False when the contact dynamics do not exist
  /// (non-finite state, feet in a singular posture).
  bool Update(const robot::RobotState& state, const std::array<bool, 2>& in_contact);

  const robot::RobotModel& model() const;
  const robot::RobotData& data() const;
  const ContactDynamics& contact() const;        ///< valid after Update returned true
  ContactGeometry geometry() const;              ///< sole frames and contacts of the last Update
  /// J_c (6 per contact) in sole axes for the given contacts, from data(): rows [force; moment] right first.
  void ContactJacobian(const std::array<bool, 2>& in_contact, Eigen::MatrixXd* jacobian) const;
};

}  // namespace poise::balance
