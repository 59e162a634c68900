#include "components/balance/joint_limits.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "components/robot/dynamics.h"

namespace poise::balance {
namespace {

/// The largest acceleration that, held over `h`, leaves `room` (rad) above position and viable
/// velocity: (v + h a)² ≤ 2 A (room − h v − h² a / 2) when the joint then still goes towards the
/// limit.
double Largest(double room, double velocity, double most_velocity, double most, double h) {
  double a = std::min(most, (most_velocity - velocity) / h);
  // q + h v + h² a / 2 ≤ limit
  a = std::min(a, 2 * (room - h * velocity) / (h * h));
  const double b = 2 * velocity / h + most;
  const double c = (velocity * velocity - 2 * most * (room - h * velocity)) / (h * h);
  const double discriminant = b * b - 4 * c;
  a = std::min(a, discriminant > 0 ? 0.5 * (-b + std::sqrt(discriminant)) : -0.5 * b);
  return std::max(a, -most);
}

}  // namespace

AccelerationRange ViableAccelerations(const JointRange& range, double position, double velocity,
                                      double horizon) {
  AccelerationRange result;
  result.upper =
      Largest(range.upper - position, velocity, range.velocity, range.acceleration, horizon);
  result.lower =
      -Largest(position - range.lower, -velocity, range.velocity, range.acceleration, horizon);
  if (result.lower > result.upper) {
    // The two limits are too near to each other, or the joint is too fast for either: it is brought
    // to rest.
    const double stop = std::clamp(-velocity / horizon, -range.acceleration, range.acceleration);
    result.lower = result.upper = stop;
  }
  return result;
}

PositionRange::PositionRange(const robot::Joint& joint) {
  const double reserve = std::min(JointLimits::kPositionReserve, 0.1 * (joint.upper - joint.lower));
  lower = joint.lower + reserve;
  upper = joint.upper - reserve;
}

JointLimits::JointLimits(const robot::RobotModel& model, double horizon) : horizon_(horizon) {
  const robot::RobotData data = robot::Evaluate(model, model.stance().joint_position);
  for (int j = 0; j < model.num_joints(); ++j) {
    const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
    const robot::MotorModel& motor = model.motors()[static_cast<size_t>(j)];
    const PositionRange positions(joint);
    JointRange range;
    range.lower = positions.lower;
    range.upper = positions.upper;
    range.velocity = joint.velocity_limit > 0 ? kVelocityShare * joint.velocity_limit
                                              : std::numeric_limits<double>::max();
    const double torque = std::min(joint.effort, motor.torque_per_ampere() * motor.peak_current);
    const double most = kTorqueShare * torque / data.mass_matrix(6 + j, 6 + j);
    range.acceleration = most > 0 && most < kHardest ? most : kHardest;
    ranges_.push_back(range);
  }
}

}  // namespace poise::balance
