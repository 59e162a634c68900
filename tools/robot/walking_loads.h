// What a step of the walk takes of a robot's joints, by inverse kinematics and dynamics.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "components/robot/robot_model.h"

namespace poise {

/// By joint.
struct StepLoads {
  Eigen::VectorXd torque;    ///< N·m, the largest of the motor's, friction included
  Eigen::VectorXd rms;       ///< N·m, root of the mean square over both feet's steps
  Eigen::VectorXd velocity;  ///< rad/s, the largest
};

/// m/s and rad/s, of the scenario `walk`: the step that is looked at walks and turns like that.
inline constexpr double kCheckedSpeed = 0.1, kCheckedTurn = 0.1;

/// One step of either foot of a steady walk, as step_planner.walk makes them:
/// the COM as a linear inverted pendulum above the stance sole's origin, the swing foot as
/// stepping::Swing moves it. `standing`: N·m that holds each joint on both feet (HoldingTorque).
/// Nothing where a posture is out of the legs' reach. Throws ConfigError: legs that the walk
/// refuses.
std::optional<StepLoads> LoadsOfAStep(const robot::RobotModel& model,
                                      const robot::RobotState& stance,
                                      const Eigen::VectorXd& standing);

}  // namespace poise
