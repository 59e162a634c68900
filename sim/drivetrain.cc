#include "sim/drivetrain.h"

#include <algorithm>
#include <cmath>

namespace poise {
namespace {

// Assumed: a stop yields 3 mrad to 150 N·m and hardly rebounds with a leg's inertia of about 1
// kg·m².
constexpr double kStopStiffness = 5e4;  // N·m/rad
constexpr double kStopDamping = 450;    // N·m·s/rad
constexpr double kElasticShare = 0.7;   // of the break-away torque
// Flanks of a gear that is rigid but for its play: they yield a tenth of a milliradian to 20 N·m.
constexpr double kFlankStiffness = 2e5;  // N·m/rad
constexpr double kFlankDamping = 85;     // N·m·s/rad, 0.3 of critical with a rotor of 0.1 kg·m²

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
      stiffness_(coulomb_ > 0 ? options.friction_stiffness : 0),
      half_backlash_(options.backlash / 2),
      gear_stiffness_(options.gear_stiffness > 0 ? options.gear_stiffness : kFlankStiffness),
      gear_damping_(options.gear_stiffness > 0 ? options.gear_damping : kFlankDamping),
      elastic_(options.elastic()) {}

void Drivetrain::Place(double q, double qd, double torque) {
  flank_ = torque < 0 ? -1 : 1;
  rotor_position_ = q + flank_ * half_backlash_ + torque / gear_stiffness_;
  rotor_velocity_ = qd;
}

JointRow Drivetrain::Begin(double h, double q, double qd, double motor_torque,
                           const DriveImpedance& drive) {
  const double speed = elastic_ ? rotor_velocity_ : qd;  // where inertia and friction are
  double gain = inertia_ / h + viscous_;
  double torque = inertia_ / h * speed;  // of the row at qd' = 0

  if (stiffness_ > 0) {
    const double ratio = stribeck_velocity_ > 0 ? speed / stribeck_velocity_ : 0;
    const double stribeck = stribeck_velocity_ > 0 ? std::exp(-ratio * ratio) : 0;
    const double slip_bristle = (coulomb_ + (static_ - coulomb_) * stribeck) / stiffness_;
    // Share of the motion that is slip rather than bending; none when the bristle relaxes.
    const double expected = bristle_ + h * speed;
    double slip = 0;
    if (expected * speed > 0) {
      const double load = std::abs(expected) / slip_bristle;
      slip = std::clamp((load - kElasticShare) / (1 - kElasticShare), 0.0, 1.0);
    }
    bristle_decay_ = 1 + slip * h * std::abs(speed) / slip_bristle;
    gain += stiffness_ * h / bristle_decay_;
    torque -= stiffness_ * bristle_ / bristle_decay_;
  }

  drive_ = drive;
  if (drive.active()) {
    motor_position_ = motor_position(q);
    gain += drive.damping + h * drive.stiffness;
    torque += drive.stiffness * (drive.position - motor_position_) + drive.damping * drive.velocity;
  }

  JointRow row;
  if (elastic_) {
    rotor_gain_ = gain;
    rotor_drive_ = torque + motor_torque;
    Mesh(h, q, qd);
    const double both = rotor_gain_ + mesh_gain_;
    gain = mesh_gain_ * rotor_gain_ / both;
    torque = (mesh_torque_ * rotor_gain_ + mesh_gain_ * rotor_drive_) / both;
  } else {
    row.torque = motor_torque;
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
  if (gain <= 0) return row;
  row.active = true;
  row.velocity = torque / gain;
  row.cfm = 1 / gain;
  return row;
}

// Chooses the flank and fills mesh_torque_ and mesh_gain_.
void Drivetrain::Mesh(double h, double q, double qd) {
  const double twist = rotor_position_ - q;
  const double rate = rotor_velocity_ - qd;
  const auto wind = [&](int flank) {
    const double beyond = twist - flank * half_backlash_;
    // A ring that the step cannot follow is damped away.
    if (flank == flank_ && gear_stiffness_ * h * h <= inertia_) {
      mesh_torque_ = gear_stiffness_ * (beyond - h / 4 * rate);
      mesh_gain_ = gear_stiffness_ * h / 4 + gear_damping_;
    } else {
      mesh_torque_ = gear_stiffness_ * beyond;
      mesh_gain_ = gear_stiffness_ * h + gear_damping_;
    }
  };
  if (half_backlash_ <= 0) return wind(flank_);

  const double free = twist + h * (rotor_drive_ / rotor_gain_ - qd);  // if no flank touched
  int flank = twist > half_backlash_ ? 1 : twist < -half_backlash_ ? -1 : 0;
  if (flank == 0) flank = free > half_backlash_ ? 1 : free < -half_backlash_ ? -1 : 0;
  if (flank != 0) {
    wind(flank);
    // A flank pushes and never pulls.
    const double torque =
        mesh_torque_ * rotor_gain_ + mesh_gain_ * (rotor_drive_ - rotor_gain_ * qd);
    if (torque * flank <= 0) flank = 0;
  }
  flank_ = flank;
  if (flank == 0) mesh_torque_ = mesh_gain_ = 0;
}

void Drivetrain::End(double h, double qd) {
  double speed = qd;
  if (elastic_) {
    speed = (rotor_drive_ - mesh_torque_ + mesh_gain_ * qd) / (rotor_gain_ + mesh_gain_);
    gear_torque_ = mesh_torque_ + mesh_gain_ * (speed - qd);
    rotor_velocity_ = speed;
    rotor_position_ += h * speed;
  }
  friction_torque_ = -viscous_ * speed;
  if (stiffness_ > 0) {
    bristle_ = (bristle_ + h * speed) / bristle_decay_;
    friction_torque_ -= stiffness_ * bristle_;
    const double longest = static_ / stiffness_;
    bristle_ = std::clamp(bristle_, -longest, longest);
  }
  drive_torque_ = drive_.active() ? drive_.Torque(motor_position_ + h * speed, speed) : 0;
  stop_torque_ = at_stop_ ? -kStopStiffness * (position_ + h * qd - limit_) - kStopDamping * qd : 0;
}

}  // namespace poise
