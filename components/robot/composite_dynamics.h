// The two backward passes of ComputeDynamics. Both read RobotData::subtree, which they sum up
// towards the base.
#pragma once

#include "components/robot/dynamics.h"

namespace poise::robot {

/// A from composite rigid bodies about the base origin; COM, its velocity and Jacobian from A's
/// linear rows.
void ComputeMassMatrix(const RobotModel& model, const RobotState& state, RobotData* data);

/// b and g by Newton–Euler at v̇ = 0; COM bias acceleration. Requires ComputeMassMatrix (gravity is
/// in A's rows).
void ComputeBias(const RobotModel& model, RobotData* data);

}  // namespace poise::robot
