// Appendix: the ratio η = F_z,r / F_z that shares the resultant between the feet, and its bounds.
//
// Each foot takes its share of the force and of the moments about the soles' own centres, which are
// linear in η; so a condition on a moment is |a η + b| < |c|, the same for both feet when they are
// parallel to frame O. An edge of a sole that is no rectangle is half of that, a η + b < c.
// Everywhere, `resultant` is the robot's on the environment in frame O, and arrays hold the right
// foot first.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/balance/contact_conditions.h"

namespace poise::balance {

/// The interval of η for which every condition of both feet holds.
struct RatioInterval {
  bool feasible = false;
  double min = 0, max = 1;  ///< valid when feasible
  double optimal =
      0.5;  ///< η* = −b/a of (71), (72): M_x of both feet zero; unbounded; 0.5 when a = 0
  /// Which condition left no η ("ratio limits", "normal", "friction", "roll", "pitch", "edge",
  /// "yaw"), for messages; nullptr when feasible.
  const char* limiting_condition = nullptr;
};

/// Limits of the right and the left sole, in their own frames.
using SoleLimits = FootArray<ContactLimits>;

/// Bounds of η from |a η + b| < |c| for M_x, M_y, M_z, (70)–(79), intersected with [eta_min,
/// eta_max] and [0, 1]. (29) and (30) do not depend on η: broken, no η is feasible. `foot`: soles
/// in O; each foot's conditions hold in its own sole frame, however it is turned or tilted.
RatioInterval FeasibleRatio(const Vector6d& resultant, const FootArray<Eigen::Isometry3d>& foot,
                            const SoleLimits& limits, double eta_min, double eta_max);
/// The same for soles of the same limits.
RatioInterval FeasibleRatio(const Vector6d& resultant, const FootArray<Eigen::Isometry3d>& foot,
                            const ContactLimits& limits, double eta_min, double eta_max);
/// The same for feet parallel to O. `foot_in_o`: sole centres in O, m.
RatioInterval FeasibleRatio(const Vector6d& resultant, const FootArray<Eigen::Vector3d>& foot_in_o,
                            const ContactLimits& limits, double eta_min, double eta_max);

/// The same where each foot may have a centre of pressure of its own, as MoveIntoSoles gives it: of
/// soles that are not alike more than of one that both have. `sole`: the polygons of `limits`'
/// edges, which both have. Exact but for the part of M_z that a tilted sole has about x and y.
RatioInterval FreeRatio(const Vector6d& resultant, const FootArray<Eigen::Isometry3d>& foot,
                        const SoleLimits& limits, const FootArray<ConvexPolygon>& sole,
                        double eta_min, double eta_max);

/// The ratio to use: η* clipped to a feasible interval. Infeasible: η* clipped to the ratios in
/// [eta_min, eta_max] whose largest violation a η + b − c (N·m, per unit of load share) of the
/// moment conditions is the least, to a millimetre of centre of pressure. Always finite and within
/// [eta_min, eta_max], which lie in [0, 1].
double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const FootArray<Eigen::Isometry3d>& foot, const SoleLimits& limits,
                   double eta_min, double eta_max);
double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const FootArray<Eigen::Isometry3d>& foot, const ContactLimits& limits,
                   double eta_min, double eta_max);
double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const FootArray<Eigen::Vector3d>& foot_in_o, const ContactLimits& limits,
                   double eta_min, double eta_max);

/// (62)–(67): each foot's share of the resultant, in its own sole frame. `foot`: sole frames in O.
/// The shares' resultant is `resultant` for every η.
FootArray<Vector6d> DistributeResultant(const Vector6d& resultant,
                                        const FootArray<Eigen::Isometry3d>& foot, double eta);

/// Where a share's centre of pressure is outside its sole: the lighter foot's moves to the nearest
/// point from which both are inside, the heavier one's so that the resultant stays. Soles that are
/// not alike can then do what their hull promises. Without such a point the lighter foot's goes
/// into its own sole. `sole`: what of each the centre of pressure may be in, sole frame, not empty.
/// Shares that do not press stay.
void MoveIntoSoles(const FootArray<Eigen::Isometry3d>& foot, const FootArray<ConvexPolygon>& sole,
                   FootArray<Vector6d>* share);

}  // namespace poise::balance
