// The two backward passes of ComputeDynamics. Both read RobotData::subtree, which they sum up
// towards the base.
#pragma once

#include "components/robot/dynamics.h"

namespace poise::robot {

/// A v of the symmetric matrix A whose lower triangle is given.
inline Eigen::Vector3d SymmetricTimes(const Eigen::Matrix3d& lower, const Eigen::Vector3d& v) {
  return {lower(0, 0) * v.x() + lower(1, 0) * v.y() + lower(2, 0) * v.z(),
          lower(1, 0) * v.x() + lower(1, 1) * v.y() + lower(2, 1) * v.z(),
          lower(2, 0) * v.x() + lower(2, 1) * v.y() + lower(2, 2) * v.z()};
}

/// A from composite rigid bodies about the base origin; COM, its velocity and Jacobian from A's
/// linear rows.
void ComputeMassMatrix(const RobotModel& model, const RobotState& state, RobotData* data);

/// b and g by Newton–Euler at v̇ = 0; COM bias acceleration. Requires ComputeMassMatrix (gravity is
/// in A's rows).
void ComputeBias(const RobotModel& model, RobotData* data);

}  // namespace poise::robot
