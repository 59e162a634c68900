// The one law that leads the centre of pressure: of walks, recoveries and feet put side by side.
#pragma once

#include <Eigen/Core>

#include "components/balance/convex_polygon.h"
#include "components/balance/minimum_jerk.h"
#include "components/framework/state_archive.h"
#include "components/step_planner/stepping/pendulum.h"

namespace poise::stepping {

/// Where the capture point shall be, and how it shall move; m, m/s, world.
struct CaptureReference {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();

  /// m: the centre of pressure that moves it so, ξ_d − ξ̇_d/ω.
  Eigen::Vector2d Cop(double frequency) const { return point - velocity / frequency; }
  void Archive(StateArchive* archive) { archive->Show(point, velocity); }
};

/// A capture point on its way from rest to rest, by minimum jerk.
struct CaptureMove {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();  ///< m, world
  double start = 0;                                ///< s
  double duration = 1;                             ///< s

  /// At `time`, s, towards `to`, m, world.
  CaptureReference At(double time, const Eigen::Vector2d& to) const {
    const balance::MinimumJerk gone(time - start, duration);
    return {from + gone.position * (to - from), gone.speed * (to - from)};
  }
  void Archive(StateArchive* archive) { archive->Show(from, start, duration); }
};

/// m, world: the centre of pressure that leads the capture point along `reference`,
/// p = ξ_d − ξ̇_d/ω + (1 + gain)(ξ − ξ_d), or the point of `support` nearest to that. By
/// ξ̇ = ω (ξ − p) the error then decays at gain ω. `beside`: m, by which the centre of pressure of
/// the whole robot lies beside it, as the body turns; the sum of both stays within `support`.
inline Eigen::Vector2d LeadingCop(const Pendulum& pendulum, const CaptureReference& reference,
                                  double gain, const balance::ConvexPolygon& support,
                                  const Eigen::Vector2d& beside = Eigen::Vector2d::Zero()) {
  const Eigen::Vector2d cop =
      reference.Cop(pendulum.frequency) + (1 + gain) * (pendulum.capture_point() - reference.point);
  return balance::NearestPoint(support, cop + beside) - beside;
}

}  // namespace poise::stepping
