// Angular momentum about the COM, and what changes it.
//
// The base's rows of A q̈ + b are the forces and, about the base's origin, the moments that the
// robot's motion asks for. About the COM, a moment (r × F less), they are the rate of the angular
// momentum: k = J_k q̇ and k̇ = J_k q̈ + J̇_k q̇, with r from the base's origin to the COM,
//   J_k = A_ω − r̂ A_v,  J̇_k q̇ = b_ω − r × b_v.
// Orin, Goswami, Lee: Centroidal dynamics of a humanoid robot, Autonomous Robots 2013.
#pragma once

#include <Eigen/Core>

#include "components/robot/dynamics.h"

namespace poise::balance {

/// J_k (3×n) and J̇_k q̇ (kg·m²/s²), world axes. Requires ComputeDynamics in `data`.
void ComputeAngularMomentumRows(const robot::RobotData& data, Eigen::Ref<Eigen::MatrixXd> jacobian,
                                Eigen::Vector3d* bias);

/// k about the COM, kg·m²/s, world axes. Requires ComputeDynamics for `state` in `data`.
Eigen::Vector3d AngularMomentum(const robot::RobotState& state, const robot::RobotData& data);

}  // namespace poise::balance
