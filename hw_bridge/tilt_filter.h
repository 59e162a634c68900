// TiltFilter: the angle between an IMU's upright direction and gravity, for a safety trip.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "components/robot/robot_model.h"

namespace poise {

/// Complementary filter: the direction "up" in the IMU's frame turns with the gyro and follows the
/// accelerometer slowly, while that reads about 1 g.
class TiltFilter {
 public:
  /// `upright`: direction in the IMU frame that points up when the robot stands; unit.
  /// time_constant: s, of the accelerometer's correction.
  TiltFilter(const Eigen::Vector3d& upright, double time_constant)
      : upright_(upright), up_(upright), time_constant_(time_constant) {}

  /// A reading, `seconds` after the one before: rad/s, m/s². Finite.
  void Update(const Eigen::Vector3d& angular_velocity, const Eigen::Vector3d& acceleration,
              double seconds) {
    const double norm = acceleration.norm();
    const bool still = std::abs(norm - robot::kGravity) < kGravityBand * robot::kGravity;
    if (!known_) {
      if (!still) return;
      up_ = acceleration / norm;
      known_ = true;
      return;
    }
    // A direction fixed in the world turns against the frame.
    up_ -= seconds * angular_velocity.cross(up_);
    if (still) up_ += std::min(1.0, seconds / time_constant_) * (acceleration / norm - up_);
    const double length = up_.norm();
    if (length > 0.1) {
      up_ /= length;
    } else {
      known_ = false;
    }
  }
  /// rad, 0 to π; 0 until the first reading of about 1 g.
  double tilt() const { return known_ ? std::acos(std::clamp(up_.dot(upright_), -1.0, 1.0)) : 0.0; }

 private:
  static constexpr double kGravityBand = 0.2;  // share of g
  Eigen::Vector3d upright_, up_;
  double time_constant_;
  bool known_ = false;
};

}  // namespace poise
