// The recovery's configuration, and what the robot makes of it.
#pragma once

#include "components/robot/robot_model.h"
#include "components/step_planner/step_planner.pb.h"
#include "components/step_planner/stepping/recovery.h"

namespace poise {

/// Throws ConfigError "recovery.sure" ...: not finite, or beyond what can work.
void CheckRecoveryConfig(const RecoveryConfig& config);

/// Reach and limits of this robot's steps, whose COM stands at its standing height. Throws
/// ConfigError when its legs reach nothing or not what is configured, or its soles are smaller than
/// the edge.
stepping::StepChoice MakeStepChoice(const RecoveryConfig& config, const robot::RobotModel& model);

/// `watch`: RecoverySpec::watch. Thresholds for this robot besides. Throws as MakeStepChoice.
stepping::Recovery MakeRecovery(const RecoveryConfig& config, const ContactConfirmation& contact,
                                const robot::RobotModel& model, double watch);

}  // namespace poise
