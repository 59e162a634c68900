#include "components/messages/quintic_move.h"

#include <algorithm>

namespace poise {

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
