// Appendix: the ratio η = F_z,r / F_z that shares the resultant between the feet, and its bounds.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "components/balance/contact_conditions.h"

namespace poise::balance {

/// The interval of η for which every condition of both feet holds.
struct RatioInterval {
  bool feasible = false;
  double min = 0, max = 1;  ///< valid when feasible
  double optimal = 0.5;     ///< η* = −b/a of (71), (72): M_x of both feet zero; unbounded; 0.5 when a = 0
  /// Which condition left no η (roll, pitch, yaw), for messages; nullptr when feasible.
  const char* limiting_condition = nullptr;
};

/// Bounds of η from |a η + b| < |c| for M_x, M_y, M_z, (70)–(79), intersected with [eta_min, eta_max].
/// `resultant` in frame O (robot on environment); `foot_in_o`: sole centres in O, right first, m.
RatioInterval FeasibleRatio(const Vector6d& resultant, const std::array<Eigen::Vector3d, 2>& foot_in_o,
                            const ContactLimits& limits, double eta_min, double eta_max);

/// η* clipped to the interval; the interval's midpoint of least violation when infeasible is never invented: infeasible
/// returns the ratio that minimises the largest violation of the three conditions over [eta_min, eta_max].
double SelectRatio(const RatioInterval& interval, const Vector6d& resultant,
                   const std::array<Eigen::Vector3d, 2>& foot_in_o, const ContactLimits& limits,
                   double eta_min, double eta_max);

/// (62)–(67): each foot's share of the resultant, in its own sole frame (rotated from O: `foot` are the sole frames in O).
std::array<Vector6d, 2> DistributeResultant(const Vector6d& resultant,
                                            const std::array<Eigen::Isometry3d, 2>& foot, double eta);

}  // namespace poise::balance
