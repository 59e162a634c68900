// How a robot stands when its maker says nothing of it: knees bent, soles level.
#pragma once

#include <Eigen/Core>

#include "components/robot/robot_model.h"
#include "tools/robot_import/anatomy.h"

namespace poise {

struct FoundStance {
  Eigen::VectorXd joint_position;  ///< rad, rounded: SolvePosture finds the exact ones from them
  robot::RobotState state;         ///< the exact ones, feet on z = 0
  double com_height = 0;           ///< m above the soles
  double foot_spacing = 0;         ///< m, between the soles' centres
  /// Where it is less than the nominal posture's spacing: that spacing, m, and the joint that bears
  /// too much on one foot there, with its torque over its limit (infinite: it cannot stand on one
  /// foot).
  double wider_spacing = 0;
  int strained = -1;
  double strain = 0;
};

/// Each joint at `wanted` or, where that is too near to a limit, away from it.
Eigen::VectorXd WithinLimits(const robot::RobotModel& model, Eigen::VectorXd wanted);

/// The nearest posture to `nominal` with both soles level, the COM above the middle between them,
/// all within the joint limits. Tries less and more bend than the usual one when `bend_knees`. The
/// feet stand as far apart as in `nominal`, or nearer, where only that lets the legs bear the robot
/// on one foot.
/// Throws RobotError saying what is out of reach.
FoundStance FindStance(const robot::RobotModel& model, const Anatomy& anatomy,
                       const Eigen::VectorXd& nominal, bool bend_knees);

}  // namespace poise
