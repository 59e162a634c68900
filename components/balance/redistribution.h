// Section 6: moving contact wrench between the feet without moving the robot.
#pragma once

#include <Eigen/Core>

#include "components/balance/contact_dynamics.h"

namespace poise::balance {

/// Γ_{a,n} of (52) in closed form: S J_cᵀ ΔF, for a change ΔF (12×1, right foot first, sole frames)
/// of the contact wrenches with zero resultant. It produces exactly ΔF and no acceleration.
/// `contact_jacobian` 12×n; k×1 into `torque`. Returns the norm of the base rows of J_cᵀ ΔF (zero
/// when the resultant is): the caller's check. NaN for wrong sizes.
double RedistributionTorque(const MatrixRef& contact_jacobian, const VectorRef& wrench_change,
                            Eigen::Ref<Eigen::VectorXd> torque);

/// The largest share, 0 to 1, of `change` that can be added to `torque` within ±`limit` (k×1 each,
/// N·m). Joints that are beyond their limit already do not count.
double ShareWithin(const VectorRef& limit, const VectorRef& torque, const VectorRef& change);

}  // namespace poise::balance
