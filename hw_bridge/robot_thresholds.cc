#include "hw_bridge/robot_thresholds.h"

#include <algorithm>
#include <cmath>

#include "components/robot/posture.h"

namespace poise {
namespace {

constexpr double kRiseTime = 7.5e-3;         // s, from nothing to the largest torque
constexpr double kErrorShare = 2.0 / 15;     // of the largest torque
constexpr double kFrictionReserve = 4;       // times the largest break-away friction
constexpr double kPendulumShare = 1.5;       // of m g h, a joint's stiffness
constexpr double kGiveTo = 1.0 / 8;          // rad, at which a joint's limit holds no more
constexpr double kRotorTime = 10e-3;         // s, rotor's inertia over the damping that holds it
constexpr double kDriveTime = 1e-3;          // s, likewise, ten cycles of a drive's own loop
constexpr double kStiffnessTime = 1.0 / 60;  // s, damping over stiffness without a rotor's inertia

/// To two significant digits: what a person would write.
double Rounded(double value) {
  if (!(value > 0)) return 0;
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

}  // namespace

RobotThresholds DeriveThresholds(const robot::RobotModel& model) {
  RobotThresholds result;
  const double pendulum =
      Rounded(kPendulumShare * model.total_mass() * robot::kGravity * robot::StandingHeight(model));
  const Eigen::VectorXd peak = robot::PeakTorques(model);
  double largest = 0, friction = 0;
  for (size_t j = 0; j < model.motors().size(); ++j) {
    const robot::MotorModel& motor = model.motors()[j];
    const double limit = peak[static_cast<Eigen::Index>(j)];
    largest = std::max(largest, limit);
    friction = std::max(friction, motor.static_friction);
    const double stiffness = std::min(pendulum, limit / kGiveTo);
    const double damping = motor.reflected_inertia > 0 ? motor.reflected_inertia / kRotorTime
                                                       : kStiffnessTime * stiffness;
    result.hold_stiffness.push_back(stiffness);
    result.hold_damping.push_back(damping);
    result.damping.push_back(2 * damping);
    result.stiffness_limit.push_back(limit / kGiveTo);
    result.damping_limit.push_back(motor.reflected_inertia > 0
                                       ? motor.reflected_inertia / kDriveTime
                                       : kStiffnessTime * limit / kGiveTo);
  }
  result.slew_limit = Rounded(largest / kRiseTime);
  result.torque_error = Rounded(kErrorShare * largest);
  result.frozen_torque = std::max(result.torque_error, kFrictionReserve * friction);
  return result;
}

}  // namespace poise
