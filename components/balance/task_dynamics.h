// Sections 3.2–3.4: operational-space tasks under contact, and the null space they leave.
#pragma once

#include <Eigen/Core>

#include "components/balance/contact_dynamics.h"

namespace poise::balance {

/// Operational-space dynamics of t stacked task rows, t ≤ rank of W. Sized once; never allocates afterwards.
class TaskDynamics {
 public:
  TaskDynamics(int num_joints, int max_task_rows);

  /// (14)–(17), (23), (27) for J t×n and J̇q̇ t×1. `contact` must hold the same state and outlive the use of the results.
  /// False, and then nothing else is valid, when the tasks are not independent under the contacts.
  bool Compute(const ContactDynamics& contact, const MatrixRef& jacobian, const VectorRef& bias_acceleration);

  /// (24), corrected: Γ = J̃ᵀ (Λ f* + μ + p). `acceleration` is f*, t×1; k×1 into `torque`.
  void TaskTorque(const VectorRef& acceleration, Eigen::Ref<Eigen::VectorXd> torque) const;
  /// Torque that compensates gravity and velocity terms only on these tasks: f* = 0 in (24) without rows → see
  /// GravityCompensation for the case of no task.
  /// Projects a torque into the tasks' null space, Ñᵀ Γ of (26), k×1, in place.
  void ProjectIntoNullSpace(Eigen::Ref<Eigen::VectorXd> torque) const;

  // The matrices of the paper, computed on demand from what Compute kept (for checks; not on the tick path).
  Eigen::MatrixXd Lambda() const;         ///< t×t, (14)
  Eigen::VectorXd Mu() const;             ///< t×1, (16)
  Eigen::VectorXd P() const;              ///< t×1, (17)
  Eigen::MatrixXd JBarTranspose() const;  ///< J̄ᵀ, t×n, (15)
  Eigen::MatrixXd JTildeTranspose() const;  ///< J̃ᵀ, k×t, (23)
};

/// Joint torques of minimum acceleration energy that hold the robot still against gravity (section 7.1: no task):
/// the W⁺-weighted solution of N_cᵀ Sᵀ Γ = N_cᵀ g projected on the motion the contacts leave; k×1 into `torque`.
void GravityCompensation(const ContactDynamics& contact, Eigen::Ref<Eigen::VectorXd> torque);

}  // namespace poise::balance
