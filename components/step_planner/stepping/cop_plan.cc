#include "components/step_planner/stepping/cop_plan.h"

#include "components/balance/minimum_jerk.h"

namespace poise::stepping {

CaptureReference CaptureMove::At(double time, const Eigen::Vector2d& to) const {
  const balance::MinimumJerk gone(time - start, duration);
  return {from + gone.position * (to - from), gone.speed * (to - from)};
}

Eigen::Vector2d LeadingCop(const Pendulum& pendulum, const CaptureReference& reference, double gain,
                           const balance::ConvexPolygon& support, const Eigen::Vector2d& beside) {
  const Eigen::Vector2d cop =
      reference.Cop(pendulum.frequency) + (1 + gain) * (pendulum.capture_point() - reference.point);
  return balance::NearestPoint(support, cop + beside) - beside;
}

}  // namespace poise::stepping
