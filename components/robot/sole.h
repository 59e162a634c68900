// The shape of a sole: a rectangle or a convex polygon.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "components/robot/robot_model.h"

namespace poise::robot {

/// What is wrong with `vertices` (m, sole frame) as a sole, and what to do; empty when they are 3
/// to kMaxSoleVertices corners of a strictly convex polygon, anticlockwise, around the origin.
std::string SoleProblem(std::span<const Eigen::Vector2d> vertices);

/// The convex hull of `points` (m) as SoleProblem takes it, also after its coordinates are rounded
/// to a micrometre: anticlockwise, of at most `most` corners, those left out that cost least area.
/// Fewer than three where the points span no area.
std::vector<Eigen::Vector2d> SoleOutline(std::vector<Eigen::Vector2d> points, size_t most);

/// Corners, m, sole frame: a polygon's anticlockwise, a rectangle's row by row.
std::vector<Eigen::Vector2d> SoleCorners(const FootModel& foot);

/// m, from `point` (sole frame) to the nearest of the lines along the sole's edges, positive
/// inside.
double DistanceInside(const FootModel& foot, const Eigen::Vector2d& point);

/// m, from the sole frame's origin to the nearest edge: half a rectangle's width.
double InnerRadius(const FootModel& foot);

}  // namespace poise::robot
