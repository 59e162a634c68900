// What the centre of pressure can reach: the hull of the soles in contact.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "components/balance/balance_control.h"
#include "components/balance/convex_polygon.h"

namespace poise::balance {

/// Hull of the corners of the soles in contact, each a rectangle of `half` (half length and half
/// width, m, right foot first) in its own frame, seen along the normal of `frame_o` on its plane.
///
/// With `half` less than the sole's by a margin it is the polygon of the soles with that margin
/// inside, and every centre of pressure in it can be shared so that each foot's own stays inside
/// its smaller rectangle: the shares of (62)–(67) move both feet's centres of pressure by the same
/// vector, and a rectangle swept from one sole to the other is their hull when they are parallel.
/// A sole higher or lower than the plane (feet at different heights) reaches somewhat farther than
/// its projection, as forces are nearer to the vertical than the plane's normal is.
ConvexPolygon SupportPolygon(const Eigen::Isometry3d& frame_o, const ContactGeometry& geometry,
                             const std::array<Eigen::Vector2d, 2>& half);

}  // namespace poise::balance
