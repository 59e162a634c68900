// How far ahead of a push a step can put the support's edge.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "components/step_planner/stepping/step_choice.h"

namespace poise {

/// m from `from` along the unit vector `along` to the edge of the stance sole and the other one
/// together, the other where it is farthest for this: beside, ahead or behind, in the legs' reach
/// with the COM anywhere that both legs allow, `gap` between the soles (stepping::Reach). How thick
/// legs are, how long the way takes and what the COM's motion is count for nothing, so that no step
/// reaches farther. `stance`: the foot that stands, its sole's centre at `sole`, m, turned by
/// `yaw`, rad; `from` in the same axes. Empty when the ray misses all of it, or the robot has no
/// reach.
std::optional<double> FarthestSupport(const stepping::StepChoice& choice, robot::Foot stance,
                                      const Eigen::Vector2d& sole, double yaw,
                                      const Eigen::Vector2d& from, const Eigen::Vector2d& along);

/// How far `from` is inside the convex hull of `points` along the unit vector `along`; empty when
/// the ray misses it.
std::optional<double> DistanceToEdge(std::span<const Eigen::Vector2d> points,
                                     const Eigen::Vector2d& from, const Eigen::Vector2d& along);

}  // namespace poise
