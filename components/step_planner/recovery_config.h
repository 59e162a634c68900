// The recovery's configuration, and what the robot makes of it.
#pragma once

#include "components/robot/robot_model.h"
#include "components/step_planner/step_planner.pb.h"
#include "components/step_planner/stepping/recovery.h"

namespace poise {

/// Reach and limits of this robot's steps, whose COM stands at its standing height. Throws
/// ConfigError when its legs reach nothing, or its soles are too small.
stepping::StepChoice MakeStepChoice(const robot::RobotModel& model);

/// The numbers of this robot's recovery. `watched_margin`: RecoverySpec's.
stepping::RecoverySpec MakeRecoverySpec(const RecoveryConfig& config,
                                        const ContactConfirmation& contact,
                                        const robot::RobotModel& model, double watched_margin);

/// Both. Throws as MakeStepChoice.
stepping::Recovery MakeRecovery(const RecoveryConfig& config, const ContactConfirmation& contact,
                                const robot::RobotModel& model, double watched_margin);

}  // namespace poise
