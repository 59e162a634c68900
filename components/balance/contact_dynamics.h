// Section 3.1 and (22): the robot's dynamics projected into its contacts.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace poise::balance {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
/// Read-only arguments. One row of a matrix is passed as middleRows(i, 1): row(i) has another
/// storage order, so that binding it would copy to the heap.
using MatrixRef = Eigen::Ref<const Eigen::MatrixXd>;
using VectorRef = Eigen::Ref<const Eigen::VectorXd>;

/// A task row that the contacts leave less than this share of is rounding: the contacts hold it.
inline constexpr double kHeld = 1e-10;

/// Joints that the tick path has scratch for.
inline constexpr int kMaxJoints = 128;

/// The same dynamics with the contacts solved for, in joint coordinates. With the first foot in
/// contact as root, the base follows the joints, q̈_b = Φ q̈_j + a_b, and a second foot leaves the
/// loop H q̈_j = −γ:
///   M q̈_j + h + Hᵀ F_2 = Γ_a.
/// An orthonormal basis V of null(H) makes every matrix of the paper small: with Vᵀ M V = L Lᵀ,
///   A⁻¹ N_cᵀ = Z Zᵀ, Z = [Φ; I] V L⁻ᵀ,  W = (V L⁻ᵀ)(V L⁻ᵀ)ᵀ,  W⁺ = V Vᵀ M V Vᵀ.
/// null(W) is the range of Hᵀ: known, not searched for. Without a second foot V = I.
///
/// Φ and H have columns for the joints between base and feet alone, the legs (s of them); all
/// others (o: waist, arms, head) meet the legs only through the base, and V is the identity for
/// them. So joints are kept in the order [legs; others]: what the contacts change is s×s, and of
/// the others M is A itself. L = [L_ss 0; L_os L_oo].
/// s×s buffers hold their matrix in the top left corner; r = k − (m − 6) is the rank of W. Rows of
/// others are filled up to whole blocks, with zeros.
struct ReducedDynamics {
  int num_joints = 0;        ///< k
  int num_contact_rows = 0;  ///< m
  int num_legs = 0;          ///< s
  int filled_others = 0;     ///< o, filled up
  std::vector<int> order;    ///< joints: legs, then others, each ascending
  Eigen::MatrixXd phi_t;     ///< Φᵀ of the legs, s×6
  Eigen::MatrixXd psi_t;  ///< ([A_bb A_bj] [Φ; I])ᵀ of the legs, s×6: base rows of A q̈ = A_bb a_b
                          ///< + Ψ q̈_j; of the others see others_coupling
  Eigen::MatrixXd mass;             ///< M_ss
  Eigen::MatrixXd rotation;         ///< [Q₁ V], s×s, of Hᵀ = Q₁ R (two feet only)
  Eigen::MatrixXd mass_basis;       ///< M_ss V, s×(s−6) (two feet only)
  Eigen::MatrixXd factor;           ///< L_ss, lower
  Eigen::MatrixXd loop;             ///< Hᵀ's Householder vectors and R, s×6 (two feet only)
  Eigen::MatrixXd others_coupling;  ///< A_ob, o×6
  Eigen::MatrixXd others_carried;   ///< A_os, o×s; empty unless legs carry other joints
  Eigen::MatrixXd others_factor;    ///< [L_os L_oo]
  Eigen::VectorXd others_inverses;  ///< of L_oo's diagonal blocks
  Matrix6d base_mass;               ///< A_bb
  Matrix6d root_transfer;           ///< G_1⁻ᵀ: base wrench → wrench of the root foot
  Matrix6d second_transfer;         ///< G_2ᵀ: wrench of the second foot → base wrench

  /// Terms that do not depend on the torque, linear in (b + g, J̇_c q̇).
  struct Bias {
    Eigen::VectorXd
        joint_torque;  ///< h of the legs, the particular acceleration's inertia included
    Eigen::VectorXd others_torque;  ///< h of the others
    Eigen::VectorXd
        joint_acceleration;      ///< of the particular solution, legs; of the others it is 0
    Vector6d base_acceleration;  ///< a_b
    Vector6d base_wrench;        ///< −(A_bb a_b + base rows of b + g)
  };
  Bias bias;
  Eigen::VectorXd gravity_torque;  ///< [Φ; I]ᵀ g, k×1, in the robot's order

  bool closed_loop() const { return num_contact_rows == 12; }
  bool legs_carry_others() const { return others_carried.size() > 0; }
  int num_others() const { return num_joints - num_legs; }
  int legs_rank() const { return num_legs - (num_contact_rows - 6); }
  int rank() const { return num_joints - (num_contact_rows - 6); }
};

/// Contact-constrained dynamics at one state. n = k + 6 velocities, m = 6 or 12 contact rows (right
/// foot first, each [force; moment] in its own sole frame, wrench of the robot on the environment).
/// Sized once; Compute never allocates.
class ContactDynamics {
 public:
  /// `num_joints` k, 1 ≤ k ≤ kMaxJoints; two feet need k > 6 (std::invalid_argument otherwise).
  /// Room for two feet.
  explicit ContactDynamics(int num_joints);
  /// The same for a J_c that is zero but for the base and `legs` (joints, ascending). Not
  /// `legs_carry_others`: A has no entries between legs and other joints either.
  ContactDynamics(int num_joints, std::span<const int> legs, bool legs_carry_others);

  /// (4)–(11) and (22). `mass_matrix` n×n symmetric, `bias` b and `gravity` g n×1,
  /// `contact_jacobian` J_c m×n whose base columns are rigid transforms [Rᵀ −Rᵀp̂; 0 Rᵀ],
  /// `contact_bias` J̇_c q̇ m×1. False, and then nothing else is valid, when a size is wrong, J_c is
  /// not of that form, A is not positive definite on the motions that the contacts leave, the
  /// contacts are dependent (J_c A⁻¹ J_cᵀ not positive definite) or an input is not finite.
  bool Compute(const MatrixRef& mass_matrix, const VectorRef& bias, const VectorRef& gravity,
               const MatrixRef& contact_jacobian, const VectorRef& contact_bias);

  int num_joints() const { return reduced_.num_joints; }
  int num_contact_rows() const { return reduced_.num_contact_rows; }
  /// Joints that contacts move, ascending.
  std::span<const int> legs() const {
    return {reduced_.order.data(), static_cast<size_t>(reduced_.num_legs)};
  }
  /// J_c, m×n.
  MatrixRef contact_jacobian() const { return contact_jacobian_.topRows(num_contact_rows()); }

  /// Contact wrenches that joint torques (k×1) produce, (34), m×1 into `wrench`.
  void ExpectedWrench(const VectorRef& torque, Eigen::Ref<Eigen::VectorXd> wrench) const;
  /// Acceleration q̈ that joint torques (k×1) produce, (9), n×1 into `acceleration`.
  void Acceleration(const VectorRef& torque, Eigen::Ref<Eigen::VectorXd> acceleration) const;

  // Reduced coordinates u = L⁻¹ Vᵀ Γ of a torque, r×1 with r = reduced().rank(): what of it moves
  // the robot. In them ẍ = T u − load for a task's rows, and what is dynamically consistent is
  // orthogonal.

  /// Γ (k×1) to u (r×1: legs, then others).
  void ReduceTorque(const VectorRef& torque, Eigen::Ref<Eigen::VectorXd> reduced) const;
  /// u (r×1) to the least Γ (k×1) that has it, V L u.
  void ExpandTorque(const VectorRef& reduced, Eigen::Ref<Eigen::VectorXd> torque) const;
  /// u (r×1) with which the joints that are no leg's accelerate by `joint_acceleration` (k×1, of
  /// which the legs' entries count for nothing), whatever the legs do: their coordinates are the
  /// last ones, u_o = L_ooᵀ q̈_o + (L⁻¹ Vᵀ h)_o. The legs' become zero.
  void HoldOthers(const VectorRef& joint_acceleration, Eigen::Ref<Eigen::VectorXd> reduced) const;
  /// J (t×n) and J̇ q̇ (t×1) of task rows to Tᵀ (r×t) and their load (t×1). Rows that the contacts
  /// hold become zero.
  void ReduceRows(const MatrixRef& jacobian, const VectorRef& bias_acceleration,
                  Eigen::Ref<Eigen::MatrixXd> rows_t, Eigen::Ref<Eigen::VectorXd> load) const;

  // The matrices of the paper, formed on demand (they allocate; the tick path needs none of them).
  Eigen::MatrixXd lambda_c() const;          ///< Λ_c, m×m, (4)
  Eigen::VectorXd mu_c() const;              ///< μ_c, m×1, (5)
  Eigen::VectorXd p_c() const;               ///< p_c, m×1, (6)
  Eigen::MatrixXd jc_bar_transpose() const;  ///< J̄_cᵀ, m×n, (7)
  Eigen::MatrixXd w() const;                 ///< W, k×k, (22)
  /// W⁺, k×k, from the known null space of W (dimension m − 6), never from a tolerance.
  Eigen::MatrixXd w_pinv() const;

  const ReducedDynamics& reduced() const { return reduced_; }

 private:
  Eigen::VectorXd Wrench(const VectorRef& generalized_force, const VectorRef& contact_bias,
                         const VectorRef& torque) const;

  ReducedDynamics reduced_;
  Eigen::MatrixXd contact_jacobian_;  // 12×n
  Eigen::VectorXd bias_, gravity_, force_, contact_bias_;
};

}  // namespace poise::balance
