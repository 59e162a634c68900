// What a joint's drivetrain adds to the motor's torque: rotor inertia, friction, the gear's play
// and compliance, the stops.
#pragma once

#include "components/robot/robot_model.h"
#include "sim/sim.pb.h"
#include "sim/world.h"

namespace poise {

/// What a drive adds to its torque by itself: stiffness (N·m/rad) and damping (N·m·s/rad) at the
/// joint, about a position (rad) that is held and a velocity (rad/s).
struct DriveImpedance {
  double stiffness = 0, damping = 0, position = 0, velocity = 0;

  bool active() const { return stiffness != 0 || damping != 0; }
  /// N·m at the motor's position and velocity.
  double Torque(double motor_position, double motor_velocity) const {
    return stiffness * (position - motor_position) + damping * (velocity - motor_velocity);
  }
};

/// One joint's share of a step, made into a single JointRow: with a rigid gear the joint torque
///   lambda = -I (qd' - qd)/h - c qd' - sigma z' - stop,
/// linear in the velocity qd' at the end of the step, so rotor inertia is exact and friction and
/// stops are implicit: stable for every step and stiffness, and a joint at rest stays at rest.
///
/// Friction is LuGre's bristle (Canudas de Wit et al., 1995) without its micro-damping, with the
/// elasto-plastic rule of Dupont et al. (2002): below 70 % of the break-away torque the bristle is
/// a pure spring, so that torque noise does not make a held posture creep.
///
/// What a drive adds by itself it adds at a rate far above the step's: stiffness and damping are
/// implicit too, where inertia and friction are.
///
/// With backlash or a compliant gear the rotor is a body of its own (angles reflected to the
/// joint): motor torque, inertia and friction act on it, and between it and the link the gear's
/// torque
///   k (theta - q -/+ backlash / 2) + d (theta' - q').
/// The rotor's velocity at the end of the step is eliminated, which leaves a row as before. While
/// the flanks touch the spring is averaged over three steps (Newmark, beta = 1/4), so that the gear
/// rings with no other damping than d; where they meet, and where the step is too long for the ring
/// (k h² > I), it is taken at the step's end.
class Drivetrain {
 public:
  struct Options {
    bool inertia = true;
    bool friction = true;
    double friction_stiffness = SimConfig().friction_stiffness();  ///< sigma, N·m/rad
    double backlash = 0;                                           ///< rad, from flank to flank
    double gear_stiffness = 0;                                     ///< k, N·m/rad; 0: rigid
    double gear_damping = 0;                                       ///< d, N·m·s/rad
    /// Whether the rotor moves apart from the link; its inertia must then be greater than 0.
    bool elastic() const { return backlash > 0 || gear_stiffness > 0; }
  };

  Drivetrain(const robot::Joint& joint, const robot::MotorModel& motor, const Options& options);

  /// Places the rotor where the gear carries `torque` (N·m) to a link at `q` (rad), both moving
  /// with `qd`.
  void Place(double q, double qd, double torque);
  /// The row for a step of `h` s from position and velocity `q`, `qd` under the motor's `torque`
  /// and what its drive adds by itself.
  JointRow Begin(double h, double q, double qd, double torque, const DriveImpedance& drive = {});
  /// Moves rotor and bristle with the link's velocity that the step ended with.
  void End(double h, double qd);

  bool elastic() const { return elastic_; }
  /// rad, reflected to the joint; of an elastic drivetrain.
  double rotor_position() const { return rotor_position_; }
  double rotor_velocity() const { return rotor_velocity_; }  ///< rad/s
  /// N·m on the link over the last step; of an elastic drivetrain.
  double gear_torque() const { return gear_torque_; }
  /// N·m over the last step, viscous part included, on the joint or on the rotor of an elastic
  /// drivetrain; 0 before the first.
  double friction_torque() const { return friction_torque_; }
  /// N·m that the drive added by itself over the last step.
  double drive_torque() const { return drive_torque_; }
  /// rad and rad/s that the drive closes on, of the joint or of an elastic drivetrain's rotor.
  double motor_position(double q) const { return elastic_ ? rotor_position_ : q; }
  double motor_velocity(double qd) const { return elastic_ ? rotor_velocity_ : qd; }
  /// N·m, of a joint stop over the last step.
  double stop_torque() const { return stop_torque_; }

 private:
  void Mesh(double h, double q, double qd);

  double lower_, upper_;
  double inertia_, viscous_, coulomb_, static_, stribeck_velocity_, stiffness_;
  double half_backlash_, gear_stiffness_, gear_damping_;
  bool elastic_;
  double bristle_ = 0;        // rad
  double bristle_decay_ = 1;  // of the step under way: z' = (z + h qd') / decay
  double limit_ = 0;          // rad, of the stop that is hit
  double position_ = 0;
  bool at_stop_ = false;
  DriveImpedance drive_;  // of the step under way
  double motor_position_ = 0, drive_torque_ = 0;
  double friction_torque_ = 0, stop_torque_ = 0;

  double rotor_position_ = 0, rotor_velocity_ = 0, gear_torque_ = 0;
  // In the step under way the rotor obeys rotor_gain w' = rotor_drive - gear torque, and the gear
  // torque is mesh_torque + mesh_gain (w' - qd').
  double rotor_gain_ = 0, rotor_drive_ = 0, mesh_torque_ = 0, mesh_gain_ = 0;
  int flank_ = 0;  // that touches: 1, the rotor ahead; -1, behind; 0, none
};

}  // namespace poise
