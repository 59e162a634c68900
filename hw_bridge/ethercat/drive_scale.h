// DriveScale: between a drive's integers and the motor's amperes and counts, joint by joint.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "components/robot/robot_model.h"
#include "hw_bridge/drive/units.h"
#include "hw_bridge/ethercat/ethercat.pb.h"

namespace poise::ethercat {

/// Signs and zeros are the joint's here, the drive's on the wire.
class DriveScale {
 public:
  /// Precondition: rated_torque and torque_constant > 0.
  DriveScale(const robot::MotorModel& motor, const DriveConfig& drive)
      : motor_(motor),
        rated_torque_(drive.rated_torque() * 1e-3),
        sign_(drive.reversed() ? -1 : 1),
        zero_counts_(drive.zero_counts()) {}

  /// Target torque, per mille of rated, of a motor current, A: the nearest, ties away from zero,
  /// within the object's range. Precondition: finite.
  int16_t TorquePerMille(double current) const {
    const double value = std::round(sign_ * current * motor_.torque_constant / rated_torque_ * 1e3);
    return static_cast<int16_t>(std::clamp(value, -32767.0, 32767.0));
  }
  /// Motor current, A, of an actual torque.
  double Current(int16_t per_mille) const {
    return sign_ * per_mille * 1e-3 * rated_torque_ / motor_.torque_constant;
  }
  /// Limit, per mille, that is not above a current, A.
  uint16_t LimitPerMille(double current) const {
    const double value = std::floor(current * motor_.torque_constant / rated_torque_ * 1e3 + 1e-9);
    return static_cast<uint16_t>(std::clamp(value, 0.0, 65535.0));
  }
  /// Counts at the motor shaft, zero at the joint's zero, of the drive's unwrapped counts.
  int64_t JointCounts(int64_t drive_counts) const { return sign_ * (drive_counts - zero_counts_); }

 private:
  robot::MotorModel motor_;
  double rated_torque_;  // N·m at the motor
  int sign_;
  int64_t zero_counts_;
};

/// Continues a 32-bit counter that wraps around as 64 bits; steps are under half its range.
class CounterUnwrap {
 public:
  int64_t Update(int32_t counter) {
    if (!known_) {
      known_ = true;
      total_ = counter;
    } else {
      // The difference modulo 2^32, as signed.
      total_ +=
          static_cast<int32_t>(static_cast<uint32_t>(counter) - static_cast<uint32_t>(total_));
    }
    return total_;
  }

 private:
  int64_t total_ = 0;
  bool known_ = false;
};

}  // namespace poise::ethercat
