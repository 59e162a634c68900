// What a joint's drivetrain adds to the motor's torque: rotor inertia, friction, the stops.
#pragma once

#include "components/robot/robot_model.h"

namespace poise {

/// One joint's share of a step, made into a single row of ODE's constraint system: the joint torque
///   lambda = -I (qd' - qd)/h - c qd' - sigma z' - stop,
/// linear in the velocity qd' at the end of the step, so rotor inertia is exact and friction and
/// stops are implicit: stable for every step and stiffness, and a joint at rest stays at rest.
///
/// Friction is LuGre's bristle (Canudas de Wit et al., 1995) without its micro-damping, with the
/// elasto-plastic rule of Dupont et al. (2002): below 70 % of the break-away torque the bristle is
/// a pure spring, so that torque noise does not make a held posture creep.
class Drivetrain {
 public:
  struct Options {
    bool inertia = true;
    bool friction = true;
    double friction_stiffness = 1e4;  ///< sigma, N·m/rad
  };
  /// Row of an ODE hinge motor without force limit; its torque is (velocity - qd') / cfm.
  struct Row {
    bool active = false;
    double velocity = 0;  ///< rad/s
    double cfm = 0;       ///< rad/s per N·m
  };

  Drivetrain(const robot::Joint& joint, const robot::MotorModel& motor, const Options& options);

  /// The row for a step of `h` s from position and velocity `q`, `qd`.
  Row Begin(double h, double q, double qd);
  /// Moves the bristle with the velocity that the step ended with.
  void End(double h, double qd);

  /// N·m on the joint over the last step, viscous part included; 0 before the first.
  double friction_torque() const { return friction_torque_; }
  /// N·m, of a joint stop over the last step.
  double stop_torque() const { return stop_torque_; }

 private:
  double lower_, upper_;
  double inertia_, viscous_, coulomb_, static_, stribeck_velocity_, stiffness_;
  double bristle_ = 0;        // rad
  double bristle_decay_ = 1;  // of the step under way: z' = (z + h qd') / decay
  double limit_ = 0;          // rad, of the stop that is hit
  double position_ = 0;
  bool at_stop_ = false;
  double friction_torque_ = 0, stop_torque_ = 0;
};

}  // namespace poise
