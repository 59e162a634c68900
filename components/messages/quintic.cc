#include "components/messages/quintic.h"

#include <algorithm>

namespace poise {

void Quintic::Begin(const Point& from, const Point& to, double start, double duration) {
  const double t = duration, v0 = from.velocity * t, v1 = to.velocity * t;
  const double a0 = from.acceleration * t * t, a1 = to.acceleration * t * t;
  const double d = to.position - from.position;
  coefficient_ = {from.position,
                  v0,
                  0.5 * a0,
                  10 * d - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
                  -15 * d + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
                  6 * d - 3 * v0 - 3 * v1 - 0.5 * a0 + 0.5 * a1};
  start_ = start;
  duration_ = duration;
}

Quintic::Point Quintic::At(double time) const {
  const auto& c = coefficient_;
  const double late = std::max(0.0, time - start_ - duration_);
  const double s = std::clamp((time - start_) / duration_, 0.0, 1.0);
  Point point;
  point.velocity =
      (c[1] + s * (2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * 5 * c[5])))) / duration_;
  point.position =
      c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5])))) + late * point.velocity;
  if (late > 0) return point;
  point.acceleration =
      (2 * c[2] + s * (6 * c[3] + s * (12 * c[4] + s * 20 * c[5]))) / (duration_ * duration_);
  return point;
}

void QuinticMove::Hold(const Eigen::Vector3d& position) {
  coefficient_.fill(Eigen::Vector3d::Zero());
  coefficient_[0] = position;
  start_ = duration_ = 0;
}

void QuinticMove::Begin(const PointMotion& from, const Eigen::Vector3d& target, double start,
                        double duration) {
  if (duration <= 0) {
    Hold(target);
    return;
  }
  const Eigen::Vector3d v = from.velocity * duration;
  const Eigen::Vector3d a = from.acceleration * (duration * duration);
  const Eigen::Vector3d d = target - from.position;
  coefficient_ = {from.position,
                  v,
                  0.5 * a,
                  10.0 * d - 6.0 * v - 1.5 * a,
                  -15.0 * d + 8.0 * v + 1.5 * a,
                  6.0 * d - 3.0 * v - 0.5 * a};
  start_ = start;
  duration_ = duration;
}

PointMotion QuinticMove::At(double time) const {
  const auto& c = coefficient_;
  PointMotion motion;
  if (duration_ <= 0) {
    motion.position = c[0];
    return motion;
  }
  const double s = std::clamp((time - start_) / duration_, 0.0, 1.0);
  motion.position = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))));
  if (s >= 1.0) return motion;
  motion.velocity =
      (c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * (4.0 * c[4] + s * (5.0 * c[5]))))) /
      duration_;
  motion.acceleration = (2.0 * c[2] + s * (6.0 * c[3] + s * (12.0 * c[4] + s * (20.0 * c[5])))) /
                        (duration_ * duration_);
  return motion;
}

}  // namespace poise
