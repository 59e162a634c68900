// Balancing in a step: the torque nearest to the tasks' whose contact wrenches the ground can give.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "components/balance/balance_control.h"
#include "components/balance/contact_dynamics.h"
#include "components/balance/convex_polygon.h"
#include "components/balance/step/box_lcp.h"

namespace poise::balance {

/// What the ground gives one sole.
struct SoleBounds {
  ConvexPolygon sole;     ///< m, sole frame: where its centre of pressure may be; not empty
  double friction = 0;    ///< coefficient μ_s of the ground, > 0
  double least_load = 0;  ///< N, pressing
};

/// What holds in a tick; feet right first.
struct StepBounds {
  std::array<bool, 2> in_contact{true, true};
  std::array<Eigen::Isometry3d, 2> sole{Eigen::Isometry3d::Identity(),
                                        Eigen::Isometry3d::Identity()};  ///< in the world
  std::array<SoleBounds, 2> foot;
  Eigen::Isometry3d frame_o = Eigen::Isometry3d::Identity();  ///< in the world
  ConvexPolygon region;  ///< m, frame O: where the resultant's centre of pressure may be
};

/// Accelerations that shall change as little as can be: J (t×n) and how much more each row's change
/// counts (t×1) than that of a motion of the same energy. A row of weight 0 is none.
struct HeldMotion {
  MatrixRef jacobian;
  VectorRef weight;
};

/// Finds the torque that keeps the bounds and changes the robot's acceleration least, by Gauss'
/// principle (measured by the robot's own inertia), with the held motions counted more:
///
///   min ½ |Δu|² + ½ Σ w_i (t_iᵀ Δu)² / |t_i|²
///
/// for the change Δu of the reduced coordinates (ContactDynamics), and of the internal wrench where
/// both feet carry. A sole's bounds are (29), its edges, and friction at each of its corners, of
/// which the moment about the vertical is a part (Caron, Pham, Nakamura 2015, ICRA, eq. 15–18):
/// (31) alone lets a sole spin. Friction is a pyramid within the cone. The joints' torque limits
/// count too. Where nothing keeps them all, what is missing is shared.
///
/// Sized once; Compute never allocates, and depends on its arguments alone.
class StepBalance {
 public:
  /// `most_held`: rows of the held motions.
  StepBalance(int num_joints, int most_held);

  struct Result {
    /// Robot on environment, sole frames; zero without contact.
    std::array<Vector6d, 2> task{Vector6d::Zero(), Vector6d::Zero()};    ///< of the torque on entry
    std::array<Vector6d, 2> wrench{Vector6d::Zero(), Vector6d::Zero()};  ///< after the change
    bool changed = false;
  };
  /// `contact` at the state and contacts of `bounds`, `effort` the joints' torque limits (k×1, N·m,
  /// > 0). With kLegs all joints that are no leg's keep the accelerations of `torque`, and their
  /// limits do not count. False, and the torque (k×1) as it was, where sizes are wrong or something
  /// is not finite.
  bool Compute(const ContactDynamics& contact, const StepBounds& bounds, const HeldMotion& held,
               const VectorRef& effort, Movers movers, Eigen::Ref<Eigen::VectorXd> torque,
               Result* result);

 private:
  /// Columns of torque and wrench, and the metric, of each coordinate; how many there are.
  Eigen::Index Span(const ContactDynamics& contact, const StepBounds& bounds, Movers movers);
  void Hold(const ContactDynamics& contact, const HeldMotion& held, Eigen::Index coordinates);
  void AddSole(const SoleBounds& bounds, Eigen::Index row);
  void AddRegion(const StepBounds& bounds);
  void AddTorque(Eigen::Index joint, const VectorRef& effort, const VectorRef& torque);
  /// a · F ≤ room for the contact wrenches F (12×1, or 6×1).
  void AddWrench(const Eigen::Matrix<double, 12, 1>& a, double room);
  /// The change within the bounds, into `step_`. False: not found.
  bool Solve();

  int num_joints_;
  Eigen::Index coordinates_ = 0, wrench_rows_ = 0, bounds_ = 0;
  Eigen::MatrixXd torque_of_, wrench_of_;  // by coordinate, k×n, m×n
  Eigen::MatrixXd metric_;                 // n×n; its Cholesky factor once it is solved with
  Eigen::MatrixXd bound_;                  // n×bounds: bound · step ≤ room
  Eigen::VectorXd room_;
  Eigen::MatrixXd held_t_;  // n×t
  Eigen::VectorXd held_load_, held_bias_;
  Eigen::VectorXd zero_, unit_, change_, wrench_, wrench_at_rest_;
  Eigen::VectorXd step_;
  // These hold the bounds that have been met: index, half of M⁻¹ bound, the dual problem.
  std::vector<Eigen::Index> met_;
  Eigen::MatrixXd answer_, dual_;
  Eigen::VectorXd dual_room_, none_, unbounded_, force_;
  BoxLcp lcp_;
};

}  // namespace poise::balance
