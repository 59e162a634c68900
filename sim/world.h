// What a physics engine does for the simulated robot. An engine's folder (sim_ode) implements it;
// nothing else in this folder knows an engine.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <string_view>

#include "components/robot/robot_model.h"

namespace poise {

/// A joint's torque over one step, linear in the joint's velocity qd' at the step's end:
///   torque + (velocity - qd') / cfm        N·m, the second term only while `active`.
/// All that a joint does reaches the engine in this form (Drivetrain): an armature I is cfm = h / I
/// with velocity qd, a viscous friction c is cfm = 1 / c with velocity 0; dry friction, gear and
/// stops are springs beside them. The engine must solve it implicitly, at once with the contacts:
/// then it is stable for every cfm.
struct JointRow {
  bool active = false;
  double velocity = 0;  ///< rad/s
  double cfm = 0;       ///< rad/s per N·m
  double torque = 0;    ///< N·m, beside it
};

struct ContactMaterial {
  double friction = 0;  ///< Coulomb coefficient
  /// N/m and N·s/m of this point alone, along the normal. Stiffness 0: rigid ground, as hard as the
  /// engine makes it.
  double stiffness = 0, damping = 0;
};

/// A point of a body on the terrain, for one step. The terrain pushes along the normal and never
/// pulls.
struct TerrainContact {
  int body = 0;
  Eigen::Vector3d position;  ///< m, world
  Eigen::Vector3d normal;    ///< unit, world, out of the terrain
  double depth = 0;          ///< m, of the body's point below the surface; a gap is negative
  double velocity = 0;       ///< m/s, of the surface along the normal
  ContactMaterial material;
};

/// The robot's bodies under gravity (-z), joined by its hinges, with no geometry of their own: who
/// steps the world finds the contacts. Bodies and joints are counted as in the RobotModel. The
/// world's frame has z upward.
///
/// The same calls give the same bits. No method throws; none but Step allocates.
class World {
 public:
  virtual ~World() = default;

  /// Places all bodies; what was set for the next step stays set.
  virtual void SetState(const robot::RobotState& state) = 0;
  /// Joint positions are counted on over full turns. `state` must be sized.
  virtual void GetState(robot::RobotState* state) const = 0;
  virtual double joint_position(int joint) const = 0;            ///< rad, multi-turn
  virtual double joint_velocity(int joint) const = 0;            ///< rad/s
  virtual Eigen::Vector3d com_position(int body) const = 0;      ///< m, world
  virtual Eigen::Vector3d com_velocity(int body) const = 0;      ///< m/s, world
  virtual Eigen::Matrix3d rotation(int body) const = 0;          ///< body to world
  virtual Eigen::Vector3d angular_velocity(int body) const = 0;  ///< rad/s, world axes
  /// Body frame (not COM) in the world.
  virtual Eigen::Isometry3d pose(int body) const = 0;
  /// False when any position or velocity is not finite.
  virtual bool Finite() const = 0;

  // Before each step:
  /// Once for every joint.
  virtual void SetJoint(int joint, const JointRow& row) = 0;
  /// N at a point (m), both in the world; forces add up.
  virtual void AddForce(int body, const Eigen::Vector3d& force, const Eigen::Vector3d& point) = 0;
  /// Beyond the number that the world was made for, contacts are dropped.
  virtual void AddContact(const TerrainContact& contact) = 0;

  /// Goes on by one step; contacts, joint torques and forces are then used up. False when the
  /// engine failed or complained: see message().
  virtual bool Step() = 0;
  /// The engine's first complaint, empty when there was none.
  virtual std::string_view message() const = 0;

  // After a step: mean force (N) and moment (N·m) on the body about its COM where the step began,
  // world axes, of contact `index` in the order of the AddContact calls.
  virtual Eigen::Vector3d contact_force(int index) const = 0;
  virtual Eigen::Vector3d contact_moment(int index) const = 0;
};

/// Makes a world of `model`, which outlives it, with room for `max_contacts` contacts in a step of
/// `step` s. Throws ConfigError when the engine cannot do it.
using WorldFactory = std::function<std::unique_ptr<World>(const robot::RobotModel& model,
                                                          int max_contacts, double step)>;

}  // namespace poise
