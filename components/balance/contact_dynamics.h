// Section 3.1 and (22): the robot's dynamics projected into its contacts.
#pragma once

#include <Eigen/Core>

namespace poise::balance {

using MatrixRef = Eigen::Ref<const Eigen::MatrixXd>;
using VectorRef = Eigen::Ref<const Eigen::VectorXd>;

/// Contact-constrained dynamics at one state. n = k + 6 velocities, m = 6 or 12 contact rows (right foot first, each
/// [force; moment] in its own sole frame, wrench of the robot on the environment). Sized once; Compute never allocates.
class ContactDynamics {
 public:
  /// `num_joints` k ≥ 1. Room for two feet.
  explicit ContactDynamics(int num_joints);

  /// (4)–(11) and (22). `mass_matrix` n×n, `bias` b and `gravity` g n×1, `contact_jacobian` J_c m×n,
  /// `contact_bias` J̇_c q̇ m×1. False, and then nothing else is valid, when A or J_c A⁻¹ J_cᵀ is not positive definite
  /// or an input is not finite.
  bool Compute(const MatrixRef& mass_matrix, const VectorRef& bias, const VectorRef& gravity,
               const MatrixRef& contact_jacobian, const VectorRef& contact_bias);

  int num_joints() const;
  int num_contact_rows() const;

  Eigen::Ref<const Eigen::MatrixXd> contact_jacobian() const;  ///< J_c, m×n
  Eigen::Ref<const Eigen::MatrixXd> lambda_c() const;          ///< Λ_c, m×m, (4)
  Eigen::Ref<const Eigen::VectorXd> mu_c() const;              ///< μ_c, m×1, (5)
  Eigen::Ref<const Eigen::VectorXd> p_c() const;               ///< p_c, m×1, (6)
  Eigen::Ref<const Eigen::MatrixXd> jc_bar_transpose() const;  ///< J̄_cᵀ, m×n, (7)
  Eigen::Ref<const Eigen::MatrixXd> w() const;                 ///< W, k×k, (22)
  /// W⁺, k×k, from the known null space of W (dimension m − 6), never from a tolerance.
  Eigen::Ref<const Eigen::MatrixXd> w_pinv() const;

  /// Contact wrenches that joint torques produce, (34), m×1 into `wrench`.
  void ExpectedWrench(const VectorRef& torque, Eigen::Ref<Eigen::VectorXd> wrench) const;
};

}  // namespace poise::balance
