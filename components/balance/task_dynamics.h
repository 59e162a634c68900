// Sections 3.2–3.4: operational-space tasks under contact, and the null space they leave.
#pragma once

#include <Eigen/Core>

#include "components/balance/block_cholesky.h"
#include "components/balance/contact_dynamics.h"

namespace poise::balance {

/// Operational-space dynamics of t stacked task rows, t ≤ rank of W. Sized once; never allocates
/// afterwards.
class TaskDynamics {
 public:
  /// `max_task_rows` ≥ 1; std::invalid_argument for sizes that cannot work.
  TaskDynamics(int num_joints, int max_task_rows);

  /// (14)–(17), (23), (27) for J t×n and J̇q̇ t×1. `contact` must hold the same state and outlive the
  /// use of the results. False, and then nothing else is valid, when a size is wrong, the tasks are
  /// not independent under the contacts or an input is not finite.
  bool Compute(const ContactDynamics& contact, const MatrixRef& jacobian,
               const VectorRef& bias_acceleration);

  int num_rows() const { return rows_; }

  /// (24), corrected: Γ = J̃ᵀ (Λ f* + μ + p), gravity and velocity terms included. `acceleration` is
  /// f*, t×1; k×1 into `torque`. For no task at all see GravityCompensation.
  void TaskTorque(const VectorRef& acceleration, Eigen::Ref<Eigen::VectorXd> torque) const;
  /// Projects a torque into the tasks' null space, Ñᵀ Γ of (26), k×1, in place.
  void ProjectIntoNullSpace(Eigen::Ref<Eigen::VectorXd> torque) const;

  // The matrices of the paper, formed on demand (they allocate; the tick path needs none of them).
  Eigen::MatrixXd Lambda() const;           ///< t×t, (14)
  Eigen::VectorXd Mu() const;               ///< t×1, (16)
  Eigen::VectorXd P() const;                ///< t×1, (17)
  Eigen::MatrixXd JBarTranspose() const;    ///< J̄ᵀ, t×n, (15)
  Eigen::MatrixXd JTildeTranspose() const;  ///< J̃ᵀ, k×t, (23)

  // What Compute kept, in the reduced coordinates y = Lᵀ Vᵀ q̈_j of ReducedDynamics, where ẍ = T y +
  // drift.
  /// T = J A⁻¹ N_cᵀ Sᵀ (W⁺)^½ of the legs, t×r_s: T Tᵀ = Λ⁻¹ with the others'.
  MatrixRef reduced_jacobian() const { return reduced_jacobian_.topLeftCorner(rows_, legs_rank_); }
  /// Tᵀ of the others, o×t, rows filled up.
  BlockMatrix others_reduced() const;
  /// Lower Cholesky factor of Λ⁻¹, t×t.
  MatrixRef factor() const { return factor_.topLeftCorner(rows_, rows_); }

 private:
  /// T of all of y, t×r.
  Eigen::MatrixXd WholeJacobian() const;
  BlockMatrix others_jacobian() const;

  const ContactDynamics* contact_ = nullptr;
  int rows_ = 0, legs_rank_ = 0;
  Eigen::MatrixXd joint_jacobian_;    // J [Φ; I] of the legs, t×s
  Eigen::MatrixXd reduced_jacobian_;  // T of the legs, t×r_s
  Eigen::MatrixXd others_jacobian_;   // Jᵀ of the others, o×t
  Eigen::MatrixXd others_reduced_;    // Tᵀ of the others, o×t
  Eigen::MatrixXd factor_;            // of T Tᵀ
  Eigen::VectorXd drift_;             // ẍ at y = 0, t×1
  Eigen::VectorXd load_;              // Λ⁻¹ (μ + p), t×1
};

/// Minimum-norm joint torques that hold a robot at rest still against gravity (section 7.1: no
/// task): Γ = W⁺ S A⁻¹ N_cᵀ g, the solution of N_cᵀ (Sᵀ Γ − g) = 0; k×1 into `torque`.
void GravityCompensation(const ContactDynamics& contact, Eigen::Ref<Eigen::VectorXd> torque);

}  // namespace poise::balance
