// Units of the drives: amperes and encoder counts at the motor, newton metres and radians at the
// joint.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "components/robot/robot_model.h"

namespace poise {

/// Joint torque of a motor current, τ = H k_T i, N·m of A. (54)
inline double JointTorque(const robot::MotorModel& motor, double current) {
  return motor.torque_per_ampere() * current;
}

/// Motor current that gives a joint torque, i = τ / (H k_T), A of N·m. (54)
inline double MotorCurrent(const robot::MotorModel& motor, double torque) {
  return torque / motor.torque_per_ampere();
}

/// Encoder counts in one radian of the joint.
inline double CountsPerRadian(const robot::MotorModel& motor) {
  return motor.gear_ratio * motor.encoder_counts / (2 * std::numbers::pi);
}

/// Joint position, rad, of multi-turn counts at the motor shaft (zero at the joint's zero).
inline double JointPositionOf(const robot::MotorModel& motor, int64_t counts) {
  return static_cast<double>(counts) / CountsPerRadian(motor);
}

/// Nearest counts of a joint position. Precondition: the result fits 63 bits.
inline int64_t EncoderCounts(const robot::MotorModel& motor, double position) {
  return std::llround(position * CountsPerRadian(motor));
}

}  // namespace poise
