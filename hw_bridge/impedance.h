// What a drive adds to its torque by itself: stiffness and damping about a moving point.
#pragma once

#include <algorithm>
#include <cmath>

namespace poise {

struct Impedance {
  double stiffness = 0, damping = 0;  ///< N·m/rad, N·m·s/rad
  double position = 0, velocity = 0;  ///< rad, rad/s

  bool active() const { return stiffness != 0 || damping != 0; }
  /// N·m at the joint's position and velocity.
  double Torque(double joint_position, double joint_velocity) const {
    return stiffness * (position - joint_position) + damping * (velocity - joint_velocity);
  }
  void Scale(double share) {
    stiffness *= share;
    damping *= share;
  }
  /// Softens it so that its torque at a position and velocity is at most `limit`. True: it had to.
  bool LimitTorque(double joint_position, double joint_velocity, double limit) {
    const double torque = std::abs(Torque(joint_position, joint_velocity));
    if (torque <= limit) return false;
    Scale(limit / torque);
    return true;
  }
};

/// Brings `*value` within the bounds. True: it had to.
inline bool Confine(double least, double most, double* value) {
  const double before = *value;
  *value = std::clamp(before, least, most);
  return *value != before;
}

}  // namespace poise
