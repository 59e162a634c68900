#include "components/step_planner/stepping/pendulum.h"

#include <cmath>

namespace poise::stepping {

Eigen::Vector2d CapturePointAfter(const Eigen::Vector2d& capture_point, const Eigen::Vector2d& cop,
                                  double frequency, double time) {
  return cop + (capture_point - cop) * std::exp(frequency * time);
}

Pendulum After(const Pendulum& pendulum, const Eigen::Vector2d& cop, double time) {
  const double w = pendulum.frequency, growth = std::exp(w * time), decay = 1 / growth;
  const double cosine = 0.5 * (growth + decay), sine = 0.5 * (growth - decay);
  const Eigen::Vector2d offset = pendulum.com - cop;
  return {cop + cosine * offset + sine / w * pendulum.velocity,
          w * sine * offset + cosine * pendulum.velocity, w};
}

double CaptureRegion(double frequency, double radius, double reach, double step_time, int steps) {
  const double decay = std::exp(-frequency * step_time);
  double region = radius;
  for (int i = 0; i < steps; ++i) region = radius + (reach - radius + region) * decay;
  return region;
}

double LargestImpulse(double mass, double frequency, double radius, double reach, double step_time,
                      int steps) {
  return mass * frequency * CaptureRegion(frequency, radius, reach, step_time, steps);
}

}  // namespace poise::stepping
