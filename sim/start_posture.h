// The robot at time 0: standing at rest where the configuration puts it.
#pragma once

#include <Eigen/Core>

#include "components/robot/dynamics.h"
#include "components/robot/robot_model.h"
#include "sim/sim.pb.h"

namespace poise {

/// Base pose and joints, all velocities zero: the robot's stance where the configuration gives
/// nothing. Throws ConfigError: unknown joint, values out of
/// range, out of reach.
robot::RobotState SolveStart(const robot::RobotModel& model, const StartPosture& config);

/// Contact wrenches (environment on robot, [force; moment], sole frames) that hold the
/// robot at rest: of all that do, those of least norm with moments measured over half a sole's
/// length. A foot out of contact has none.
robot::FootArray<robot::Vector6d> RestWrenches(const robot::RobotModel& model,
                                               const robot::RobotState& state,
                                               const robot::FootArray<bool>& in_contact);

/// Joint torques (N·m) that hold the robot at rest under these wrenches.
Eigen::VectorXd RestTorques(const robot::RobotModel& model, const robot::RobotState& state,
                            const robot::FootArray<robot::Vector6d>& wrenches);

}  // namespace poise
