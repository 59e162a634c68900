// What holds a robot's joints while it stands, on both feet and on one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "components/robot/robot_model.h"

namespace poise {

/// N·m, by joint, unsigned: holds the robot at rest on the feet in contact, by the contact wrenches
/// of least norm (RestWrenches).
Eigen::VectorXd HoldingTorque(const robot::RobotModel& model, const robot::RobotState& state,
                              const std::array<bool, 2>& in_contact);

/// The posture nearest to `stance` with the COM above the origin of one foot's sole and both soles
/// where they stand, at the stance's height or a tenth lower at most. None within the joints'
/// limits: nothing.
std::optional<robot::RobotState> OnOneFoot(const robot::RobotModel& model,
                                           const robot::RobotState& stance, size_t foot);

/// N·m, by joint, unsigned: the larger of what holds it on the right foot and on the left. Nothing
/// where either has no posture.
std::optional<Eigen::VectorXd> OneFootTorque(const robot::RobotModel& model,
                                             const robot::RobotState& stance);

}  // namespace poise
