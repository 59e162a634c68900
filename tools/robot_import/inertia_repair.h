// Inertias that no body can have: what they hide, and the nearest that one can.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace poise {

/// kg·m², of a rotor about the unit vector `axis` whose reflected inertia is part of `inertia`:
/// what is above the middle of what the link's own moment about the axis can be, given the two
/// across it (the middle is the larger of them, the range is the smaller to either side). Nothing
/// when the inertia obeys the triangle inequality or its excess does not lie along the axis.
std::optional<double> HiddenRotor(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& axis);

/// The physical inertia with the same principal axes whose moments are nearest (least squares).
Eigen::Matrix3d NearestPhysical(const Eigen::Matrix3d& inertia);

/// Returns the inertia of a solid sphere as dense as water.
Eigen::Matrix3d SphereInertia(double mass);

}  // namespace poise
