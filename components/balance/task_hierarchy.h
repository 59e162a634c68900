// Tasks of strict priorities: each level gets what those above it leave of the motions that the
// contacts allow.
//
// Sentis, Khatib: Synthesis of whole-body behaviors through hierarchical control of behavioral
// primitives, IJHR 2005, with the contact-consistent dynamics of section 3: the paper's (28) for
// any number of levels. In the reduced coordinates of ContactDynamics, where ẍ_i = T_i u − load_i
// and the dynamically consistent projections are orthogonal ones, level i adds
//   u_i = u_{i−1} + (T_i N_{i−1})⁺ (f*_i + load_i − T_i u_{i−1}),  N_i = N_{i−1} − (T_i N_{i−1})⁺
//   T_i N_{i−1}.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "components/balance/contact_dynamics.h"
#include "components/balance/task_dynamics.h"

namespace poise::balance {

/// Sized once; never allocates afterwards.
class TaskHierarchy {
 public:
  /// What became of a level.
  struct Level {
    int rows = 0;
    int directions = 0;    ///< motions that it has taken of those left
    bool complete = true;  ///< all its rows can be met, exactly
  };

  /// At most `max_rows` rows on one level and `max_levels` levels, both ≥ 1; of the first level at
  /// most `num_joints` rows count. std::invalid_argument for sizes that cannot work.
  TaskHierarchy(int num_joints, int max_rows, int max_levels);

  /// The torque that makes ẍ = `acceleration` (f*, t×1) level by level, gravity and velocity terms
  /// included. `jacobian` J t×n and `bias_acceleration` J̇q̇ t×1 have the levels' rows one after the
  /// other, highest priority first, `level_rows` (each ≥ 1) how many of them each has. Rows of the
  /// first level must be independent under the contacts; false, and nothing else is valid, when
  /// they are not, a size is wrong or an input is not finite. Lower levels come as near as they
  /// can, in the norm of each row's effective mass; a direction that the levels above leave less
  /// than kFading of is followed the less the less is left of it, so that torques stay bounded.
  /// `contact` must outlive the use of the results.
  ///
  /// With `others` (k×1, rad/s²) the joints that are no leg's come before all levels: they
  /// accelerate just so, and the levels have the legs alone. The legs' entries count for nothing.
  bool Compute(const ContactDynamics& contact, const MatrixRef& jacobian,
               const VectorRef& bias_acceleration, const VectorRef& acceleration,
               std::span<const int> level_rows, const Eigen::VectorXd* others = nullptr);

  /// k×1. It does nothing in the motions that no level determines.
  const Eigen::VectorXd& torque() const { return torque_; }
  std::span<const Level> levels() const { return {levels_.data(), num_levels_}; }
  /// Motions that no level determines.
  int num_free() const;
  /// Directions that levels follow less than they ask, because too little of them is left.
  int num_fading() const { return num_fading_; }
  /// Projects a torque (k×1) into the null space of all levels, in place.
  void ProjectIntoNullSpace(Eigen::Ref<Eigen::VectorXd> torque) const;

  static constexpr double kFading = 1e-2;

 private:
  bool ComputeHolding(const MatrixRef& jacobian, const VectorRef& bias_acceleration,
                      const VectorRef& acceleration, std::span<const int> level_rows,
                      const Eigen::VectorXd& others);
  bool AddLevel(Eigen::Index first_row, Eigen::Index t, const MatrixRef& jacobian,
                const VectorRef& bias_acceleration, const VectorRef& acceleration);
  /// Scales rows to unit length, takes out what is in the basis already, and extends the basis by
  /// what is left, largest first. Returns the number of directions.
  Eigen::Index ExtendBasis(Eigen::Index t, bool* complete);
  /// Takes out of `vector` what lies in the basis' directions.
  void RemoveBasis(Eigen::Ref<Eigen::VectorXd> vector) const;

  const ContactDynamics* contact_ = nullptr;
  TaskDynamics first_;
  Eigen::VectorXd torque_;
  std::vector<Level> levels_;
  size_t num_levels_ = 0;
  int num_fading_ = 0;
  bool others_held_ = false;
  Eigen::Index rank_ = 0, basis_size_ = 0;
  Eigen::Index span_ = 0;         // reduced coordinates that the levels have: the legs' or all
  Eigen::MatrixXd basis_;         // r×r, orthonormal columns: what the levels have taken
  Eigen::MatrixXd rows_;          // r×t, Tᵀ of one level
  Eigen::MatrixXd coefficients_;  // t×r, of the level's rows in its directions
  Eigen::MatrixXd normal_;        // of the level's least squares
  Eigen::VectorXd scale_, load_, wanted_, fading_, step_, reduced_, change_;
};

}  // namespace poise::balance
