// Section 5: the centre of pressure kept inside its region by torque in the null space of the COM's
// height.
#pragma once

#include <Eigen/Core>

#include "components/balance/contact_conditions.h"
#include "components/balance/contact_dynamics.h"
#include "components/balance/convex_polygon.h"
#include "components/balance/task_dynamics.h"

namespace poise::balance {

/// The contacts of one tick.
struct ContactGeometry {
  FootArray<Eigen::Isometry3d> sole{Eigen::Isometry3d::Identity(),
                                    Eigen::Isometry3d::Identity()};  ///< sole frames in the world
  FootArray<bool> in_contact{true, true};
};

struct BalanceResult {
  bool active_x = false,
       active_y = false;  ///< which coordinate of the task torque's CoP left its bounds
  Eigen::Isometry3d frame_o = Eigen::Isometry3d::Identity();  ///< in the world
  Vector6d resultant_task =
      Vector6d::Zero();  ///< robot on environment, frame O, of the task torque alone
  Vector6d resultant = Vector6d::Zero();  ///< after balancing
  Eigen::Vector2d cop_task = Eigen::Vector2d::Zero(),
                  cop = Eigen::Vector2d::Zero();          ///< m, frame O
  Eigen::Vector2d cop_desired = Eigen::Vector2d::Zero();  ///< O_d in frame O, m
};

enum class BalanceStatus {
  kOk,
  kSingular,  ///< no frame O, no inverse of (42), or not finite: the torque stays as it was
  kUnloaded,  ///< F_z ≥ 0: no centre of pressure exists; the torque stays as it was
};

/// What moves so that the centre of pressure does.
enum class Movers {
  kAllJoints,  ///< (42): as their inertia makes it cheapest; light arms and heads move most
  kLegs,       ///< the joints between base and feet; all others keep the task torque's acceleration
};

/// (35)–(46). Sized once; never allocates afterwards.
class BalanceControl {
 public:
  /// `max_protected_rows`: rows of the high-priority task (1: the COM's height).
  /// std::invalid_argument when < 1.
  BalanceControl(int num_joints, int max_protected_rows);

  /// Adds to `torque` (k×1, the task torque on entry) the null-space torque Ñ_hᵀ Γ_{a,c} that puts
  /// the centre of pressure of the resultant on the nearest point of the rectangle |r_x| ≤
  /// half_length, |r_y| ≤ half_width of frame O. `protected_task` is the high-priority task h (e.g.
  /// COM height), computed for the same `contact`; `geometry` has the feet that `contact` was
  /// computed for. Not `enabled`: evaluates only.
  BalanceStatus Compute(const ContactDynamics& contact, const TaskDynamics& protected_task,
                        const ContactGeometry& geometry, const ContactLimits& limits, bool enabled,
                        Eigen::Ref<Eigen::VectorXd> torque, BalanceResult* result,
                        Movers movers = Movers::kAllJoints);
  /// The same with any convex region of frame O's plane, not empty, in place of the rectangle.
  BalanceStatus Compute(const ContactDynamics& contact, const TaskDynamics& protected_task,
                        const ContactGeometry& geometry, const ConvexPolygon& region, bool enabled,
                        Eigen::Ref<Eigen::VectorXd> torque, BalanceResult* result,
                        Movers movers = Movers::kAllJoints);

 private:
  /// `nearest`: a centre of pressure to the allowed one nearest to it.
  template <class Nearest>
  BalanceStatus ComputeWith(const Nearest& nearest, const ContactDynamics& contact,
                            const TaskDynamics& protected_task, const ContactGeometry& geometry,
                            bool enabled, Eigen::Ref<Eigen::VectorXd> torque, BalanceResult* result,
                            Movers movers);

  int num_joints_;
  Eigen::MatrixXd moment_;      // r_s×2, (42) in reduced coordinates, transposed
  Eigen::MatrixXd factor_;      // of the legs' part of T_h T_hᵀ
  Eigen::MatrixXd projection_;  // t_h×2
};

}  // namespace poise::balance
