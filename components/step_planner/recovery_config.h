// The recovery's configuration, and what the robot makes of it.
#pragma once

#include "components/robot/robot_model.h"
#include "components/step_planner/step_planner.pb.h"
#include "components/step_planner/stepping/recovery.h"

namespace poise {

/// Throws ConfigError "recovery.sure" ...: not finite, or beyond what can work.
void CheckRecoveryConfig(const RecoveryConfig& config);

/// `watch`: RecoverySpec::watch. Reach, limits and thresholds for this robot, whose COM stands at
/// its standing height. Throws ConfigError when its legs reach nothing or its soles are smaller
/// than the edge.
stepping::Recovery MakeRecovery(const RecoveryConfig& config, const ContactConfirmation& contact,
                                const robot::RobotModel& model, double watch);

}  // namespace poise
