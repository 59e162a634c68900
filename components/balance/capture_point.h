// The capture point of the linear inverted pendulum: where the centre of pressure must be for the
// COM to come to rest above it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/balance/convex_polygon.h"

namespace poise::balance {

/// The capture point on the plane of frame O.
struct CapturePoint {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m, frame O
  double frequency = 0;                                ///< rad/s, ω = √(g/h)
};

/// ξ = c + (v + (L_y, −L_x)/(m h)) / ω above the plane of `frame_o`, h the COM's height above that
/// plane along the vertical. `com` m and `velocity` m/s in the world, `angular_momentum` L about
/// the COM per mass, m²/s, world axes: what of it the feet have to stop counts like the COM's own,
/// since both are momentum about the centre of pressure. Zero L is the pendulum's. False, and
/// `capture` unchanged, when the COM is not above the plane, the plane stands upright or an input
/// is not finite.
bool ComputeCapturePoint(const Eigen::Isometry3d& frame_o, const Eigen::Vector3d& com,
                         const Eigen::Vector3d& velocity, const Eigen::Vector3d& angular_momentum,
                         double gravity, CapturePoint* capture);

struct Step {
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  ///< m, frame O
  double time = 0;                                     ///< s from now
};

/// The latest step that stops a capture point outside `support`: with the centre of pressure kept
/// at the support's nearest point p, ξ runs away as p + (ξ − p) e^{ωt}; `time` is when it is
/// `reach` (m) beyond p, as far as a foot can be put, and `position` where it is then. Beyond it
/// already: time 0 and where it is. Precondition: ξ outside, support not empty.
Step LatestStep(const ConvexPolygon& support, const CapturePoint& capture, double reach);

}  // namespace poise::balance
