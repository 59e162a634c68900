// Stiffness and damping for the drives to close about the planned motion.
#pragma once

#include <vector>

#include "components/redistributor/redistributor.pb.h"
#include "components/robot/robot_model.h"
#include "poise/joint_command_t.hpp"

namespace poise {

/// A drive gives torque + k (q_d - q) + d (q̇_d - q̇). With q_d, q̇_d the motion that the torque is
/// computed to cause, from the state to when the command acts, it gives the torque itself as long
/// as the joint moves so: the commanded wrenches stay what they are, and only the deviation is
/// answered. By joint, damping is the reflected inertia of the rotor over rotor_time, stiffness the
/// damping over a tenth of a second; a joint without rotor inertia has neither.
class PlannedImpedance {
 public:
  PlannedImpedance() = default;
  /// `period`, s, of a cycle. Throws ConfigError (paths inside SharedImpedance).
  PlannedImpedance(const SharedImpedance& config, const robot::RobotModel& model, double period);

  bool enabled() const { return !damping_.empty(); }
  /// s from the state to when the command acts.
  double horizon() const { return horizon_; }
  /// Fills position, velocity, stiffness and damping of `command`, sized for the robot, of which
  /// `acceleration` (rad/s²) is the torque's.
  void Plan(const robot::RobotState& state, const Eigen::Ref<const Eigen::VectorXd>& acceleration,
            joint_command_t* command) const;

 private:
  double horizon_ = 0;
  std::vector<double> stiffness_, damping_;  // by joint; none: not enabled
};

/// Torque alone.
void ClearImpedance(joint_command_t* command);

}  // namespace poise
