// A standing posture by inverse kinematics: soles where they are wanted, COM above a point.
#pragma once

#include <Eigen/Core>

#include "components/robot/dynamics.h"
#include "components/robot/robot_model.h"

namespace poise::robot {

struct PostureGoal {
  /// Sole frames in the world.
  FootArray<Eigen::Isometry3d> foot;
  /// Desired COM, m, world.
  Eigen::Vector2d com_xy = Eigen::Vector2d::Zero();
  double com_height = 0;  ///< m, world
  /// Joint positions the solver starts from and, beyond the goal, stays near.
  Eigen::VectorXd nominal;
};

/// Solves for base pose (upright, yaw 0: body orientation identity) and joints by damped
/// Gauss–Newton within the joint limits. Throws RobotError saying what could not be reached and by
/// how much (tolerance 1e-8).
RobotState SolvePosture(const RobotModel& model, const PostureGoal& goal);

/// m, of the COM above the soles in the robot's stance (RobotModel::stance).
double StandingHeight(const RobotModel& model);
/// m between the soles' centres in that stance.
double StandingSpacing(const RobotModel& model);
/// That stance on level ground: soles at ± half the spacing beside the origin, the COM above it.
PostureGoal StandingGoal(const RobotModel& model);
/// The joint of a foot's chain that is farthest from both its ends, where the kinematics `data` has
/// them: a leg's knee. −1: there is none.
int Knee(const RobotModel& model, const RobotData& data, Foot foot);

}  // namespace poise::robot
