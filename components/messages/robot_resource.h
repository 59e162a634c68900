// The run's robot, loaded once for all components of a process.
#pragma once

#include <memory>

#include "components/framework/component.h"
#include "components/robot/robot_model.h"

namespace poise {

/// The model from the resources "robot" and "urdf". Throws ConfigError with what the loader has to
/// say.
std::shared_ptr<const robot::RobotModel> LoadRobot(const ComponentContext& context);

/// Counts of a message that begins with {num_joints, num_feet}.
MessageCounts JointAndFootCounts(const robot::RobotModel& model);
/// {num_joints} alone, {num_feet} alone.
MessageCounts JointCounts(const robot::RobotModel& model);
MessageCounts FootCounts(const robot::RobotModel& model);

}  // namespace poise
