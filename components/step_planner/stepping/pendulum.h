// The linear inverted pendulum in closed form, and what steps can capture.
#pragma once

#include <Eigen/Core>

namespace poise::stepping {

/// Horizontal motion of the COM above level ground; m, m/s, 1/s, any axes.
struct Pendulum {
  Eigen::Vector2d com = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();
  double frequency = 1;  ///< ω = √(g/h), > 0

  Eigen::Vector2d capture_point() const { return com + velocity / frequency; }
};

/// ξ(t) = p + (ξ − p) e^{ωt} for a centre of pressure that stays at `cop`, m; t in s.
Eigen::Vector2d CapturePointAfter(const Eigen::Vector2d& capture_point, const Eigen::Vector2d& cop,
                                  double frequency, double time);

/// The pendulum after t s with the centre of pressure at `cop`: c − p = (c₀ − p) cosh ωt +
/// v₀/ω sinh ωt.
Pendulum After(const Pendulum& pendulum, const Eigen::Vector2d& cop, double time);

/// Largest sudden impulse, N·s, at the COM that is survived with N steps, each `step_time` s after
/// the one before: m ω d_N with d_0 = r, d_N = r + (l − r + d_{N−1}) e^{−ωT} (Koolen et al. 2012,
/// eq. 31). `radius`: r, m from the COM at rest to the edge of the support, the same of the sole
/// that each step stands on; `reach`: l, m, from the centre of pressure at an edge to that of the
/// next foot's. With N = 1: m ω (r + l e^{−ωT}).
double LargestImpulse(double mass, double frequency, double radius, double reach, double step_time,
                      int steps);

/// d_N above without the mass: how far beyond the point that carries the capture point may be.
double CaptureRegion(double frequency, double radius, double reach, double step_time, int steps);

}  // namespace poise::stepping
