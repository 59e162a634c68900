// What a simulated drive adds to its torque by itself.
#pragma once

namespace poise {

/// Stiffness (N·m/rad) and damping (N·m·s/rad) at the joint, about a position (rad) that is held
/// and a velocity (rad/s).
struct DriveImpedance {
  double stiffness = 0, damping = 0, position = 0, velocity = 0;

  bool active() const { return stiffness != 0 || damping != 0; }
  /// N·m at the motor's position and velocity.
  double Torque(double motor_position, double motor_velocity) const {
    return stiffness * (position - motor_position) + damping * (velocity - motor_velocity);
  }
};

}  // namespace poise
