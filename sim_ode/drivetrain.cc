#include "sim_ode/drivetrain.h"

#include <algorithm>
#include <cmath>

namespace poise {
namespace {

// Assumed: a stop yields 3 mrad to 150 N·m and hardly rebounds with a leg's inertia of about 1
// kg·m².
constexpr double kStopStiffness = 5e4;  // N·m/rad
constexpr double kStopDamping = 450;    // N·m·s/rad
constexpr double kElasticShare = 0.7;   // of the break-away torque

}  // namespace

Drivetrain::Drivetrain(const robot::Joint& joint, const robot::MotorModel& motor,
                       const Options& options)
    : lower_(joint.lower),
      upper_(joint.upper),
      inertia_(options.inertia ? motor.reflected_inertia : 0),
      viscous_(options.friction ? motor.viscous_friction : 0),
      coulomb_(options.friction ? motor.coulomb_friction : 0),
      static_(options.friction ? std::max(motor.static_friction, motor.coulomb_friction) : 0),
      stribeck_velocity_(motor.stribeck_velocity),
      stiffness_(coulomb_ > 0 ? options.friction_stiffness : 0) {}

Drivetrain::Row Drivetrain::Begin(double h, double q, double qd) {
  double gain = inertia_ / h + viscous_;
  double torque = inertia_ / h * qd;  // of the row at qd' = 0

  if (stiffness_ > 0) {
    const double ratio = stribeck_velocity_ > 0 ? qd / stribeck_velocity_ : 0;
    const double stribeck = stribeck_velocity_ > 0 ? std::exp(-ratio * ratio) : 0;
    const double slip_bristle = (coulomb_ + (static_ - coulomb_) * stribeck) / stiffness_;
    // Share of the motion that is slip rather than bending; none when the bristle relaxes.
    const double expected = bristle_ + h * qd;
    double slip = 0;
    if (expected * qd > 0) {
      const double load = std::abs(expected) / slip_bristle;
      slip = std::clamp((load - kElasticShare) / (1 - kElasticShare), 0.0, 1.0);
    }
    bristle_decay_ = 1 + slip * h * std::abs(qd) / slip_bristle;
    gain += stiffness_ * h / bristle_decay_;
    torque -= stiffness_ * bristle_ / bristle_decay_;
  }

  position_ = q;
  at_stop_ = q < lower_ || q > upper_;
  if (at_stop_) {
    limit_ = q < lower_ ? lower_ : upper_;
    const double spring = kStopStiffness * (q - limit_);
    // A stop pushes and never pulls.
    at_stop_ = (spring + (kStopDamping + h * kStopStiffness) * qd) * spring > 0;
    if (at_stop_) {
      gain += kStopDamping + h * kStopStiffness;
      torque -= spring;
    }
  }
  if (gain <= 0) return {};
  return {true, torque / gain, 1 / gain};
}

void Drivetrain::End(double h, double qd) {
  friction_torque_ = -viscous_ * qd;
  if (stiffness_ > 0) {
    bristle_ = (bristle_ + h * qd) / bristle_decay_;
    friction_torque_ -= stiffness_ * bristle_;
    const double longest = static_ / stiffness_;
    bristle_ = std::clamp(bristle_, -longest, longest);
  }
  stop_torque_ = at_stop_ ? -kStopStiffness * (position_ + h * qd - limit_) - kStopDamping * qd : 0;
}

}  // namespace poise
