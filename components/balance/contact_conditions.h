// Section 4: contact conditions (29)–(33) of a sole, frame O, the resultant (35) and its centre of
// pressure (37), (38).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/balance/contact_dynamics.h"
#include "components/balance/convex_polygon.h"
#include "components/robot/foot.h"

namespace poise::balance {

using robot::Foot;
using robot::FootArray;
using robot::kFeet;

/// Limits of one contact patch, in its own frame.
struct ContactLimits {
  double friction = 0.9;      ///< μ_s, (30)
  double yaw_friction = 0.9;  ///< μ_z, m, (31)
  double half_length = 0;     ///< l_x/2, m, (33), (37)
  double half_width = 0;      ///< l_y/2, m, (32), (38)
  /// Any convex patch: where there are edges, they stand in place of half_length and half_width.
  HalfPlanes edges = {};
};

/// Distance from each condition, positive inside.
struct ContactMargins {
  double normal = 0;    ///< N, (29)
  double friction = 0;  ///< N, (30)
  double yaw = 0;       ///< N·m, (31)
  double roll = 0;      ///< N·m, (32); of edges the least, |F_z| times the distance to the edge
  double pitch = 0;     ///< N·m, (33); of edges likewise
  /// All margins ≥ −tolerance (N and N·m alike). NaN is never met.
  bool Met(double tolerance = 1e-6) const;
};

/// Margins of a wrench [F; M] of the robot on the environment in the patch's frame.
ContactMargins CheckContact(const Vector6d& wrench, const ContactLimits& limits);

/// Centre of pressure (r_x, r_y), m, in the wrench's frame: (−M_y/F_z, M_x/F_z). F_z must not be
/// zero.
Eigen::Vector2d CenterOfPressure(const Vector6d& wrench);

/// Frame O in the world. Both feet: midway between the soles, y along the line from the right to
/// the left sole centre, z as near to the soles' mean normal as that allows. One foot: that sole's
/// frame. False, and `frame` unchanged, without a contact, when the
/// soles' centres coincide (within 1 µm), when the line between them is parallel to the mean normal
/// or when a pose is not finite.
bool FrameO(const FootArray<Eigen::Isometry3d>& sole, const FootArray<bool>& in_contact,
            Eigen::Isometry3d* frame);

/// K block of one foot, (35) and (44) corrected: wrench in its sole frame → wrench in `frame`, [R
/// 0; P̂R R]. Both frames are given in the same frame, e.g. the world.
Matrix6d WrenchTransform(const Eigen::Isometry3d& frame, const Eigen::Isometry3d& sole);

}  // namespace poise::balance
