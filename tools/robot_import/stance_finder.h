// How a robot stands when its maker says nothing of it: knees bent, soles level.
#pragma once

#include <Eigen/Core>
#include <string>

#include "components/robot/robot_model.h"
#include "tools/robot_import/anatomy.h"

namespace poise {

struct FoundStance {
  Eigen::VectorXd joint_position;  ///< rad, rounded: SolvePosture finds the exact ones from them
  double com_height = 0;           ///< m above the soles
  double foot_spacing = 0;         ///< m, between the soles' centres
};

/// Each joint at `wanted` or, where that is too near to a limit, away from it.
Eigen::VectorXd WithinLimits(const robot::RobotModel& model, Eigen::VectorXd wanted);

/// `nominal` with the legs' knees bent by `bend` rad in all, hips and ankles turned so that the
/// foot stays below the hip and level. Legs without a knee about the lateral axis stay as they are.
Eigen::VectorXd WithBentKnees(const robot::RobotModel& model, const Anatomy& anatomy, double bend,
                              Eigen::VectorXd nominal);

/// The nearest posture to `nominal` with both soles level, the COM above the middle between them,
/// all within the joint limits. Tries less and more bend than the usual one when `bend_knees`.
/// Throws RobotError saying what is out of reach.
FoundStance FindStance(const robot::RobotModel& model, const Anatomy& anatomy,
                       const Eigen::VectorXd& nominal, bool bend_knees);

}  // namespace poise
