// What the centre of pressure can reach: the hull of the soles in contact.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/balance/balance_control.h"
#include "components/balance/convex_polygon.h"
#include "components/robot/robot_model.h"

namespace poise::balance {

/// The sole in its own frame, less `margin` (m) on every side; empty, for a polygon, when that has
/// no area.
ConvexPolygon SolePolygon(const robot::FootModel& foot, double margin);
/// The points of the sole about which an ellipse of half axes `margin` along x and `side_margin`
/// along y (m) lies in it: the same of two that are equal.
ConvexPolygon SolePolygon(const robot::FootModel& foot, double margin, double side_margin);

/// Hull of the soles in contact, each a polygon of at most robot::kMaxSoleVertices corners in its
/// own frame (m), seen along the normal of `frame_o` on its plane.
///
/// With soles less a margin it is the polygon of the soles with that margin inside, and every
/// centre of pressure in it can be shared so that each foot's own stays inside its smaller sole:
/// the shares of (62)–(67) move both feet's centres of pressure by the same vector, and a sole
/// swept from one foot to the other is their hull when both have one shape and are parallel. Of
/// soles that mirror each other somewhat less can be shared. A sole higher or lower than the plane
/// (feet at different heights) reaches somewhat farther than its projection, as forces are nearer
/// to the vertical than the plane's normal is.
ConvexPolygon SupportPolygon(const Eigen::Isometry3d& frame_o, const ContactGeometry& geometry,
                             const FootArray<ConvexPolygon>& sole);

}  // namespace poise::balance
