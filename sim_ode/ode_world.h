// A RobotModel as bodies and hinges in an ODE world: the only file that talks to ODE.
#pragma once

#include <ode/ode.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string_view>
#include <vector>

#include "components/robot/robot_model.h"
#include "sim_ode/drivetrain.h"
#include "sim_ode/terrain.h"

namespace poise {

/// Owns a world without geometry: the caller finds the contacts. ODE's dWorldStep (direct solver)
/// is used throughout; it is first order in the step and repeatable bit for bit. No method here
/// allocates; dWorldStep itself does.
class OdeWorld {
 public:
  /// Room for `max_contacts` contacts in a step. Throws ConfigError when ODE was built in single
  /// precision.
  OdeWorld(const robot::RobotModel& model, int max_contacts);
  ~OdeWorld();
  OdeWorld(const OdeWorld&) = delete;
  OdeWorld& operator=(const OdeWorld&) = delete;

  void SetState(const robot::RobotState& state);
  /// Joint positions are counted on over full turns. `state` must be sized.
  void GetState(robot::RobotState* state) const;

  double joint_position(int joint) const;            ///< rad, multi-turn
  double joint_velocity(int joint) const;            ///< rad/s
  Eigen::Vector3d com_position(int body) const;      ///< m, world
  Eigen::Vector3d com_velocity(int body) const;      ///< m/s
  Eigen::Matrix3d rotation(int body) const;          ///< body to world
  Eigen::Vector3d angular_velocity(int body) const;  ///< rad/s, world axes
  /// Body frame (not COM) in the world.
  Eigen::Isometry3d pose(int body) const;
  /// False when any position or velocity is not finite.
  bool Finite() const;

  // Before each step:
  void SetDrivetrain(int joint, const Drivetrain::Row& row);
  void AddForce(int body, const Eigen::Vector3d& force, const Eigen::Vector3d& point);  ///< world
  /// A contact at `position` (world) that pushes `body` along `normal`; `depth` in m,
  /// `velocity` in m/s of the surface along the normal.
  void AddContact(int body, const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                  double depth, double velocity, const Terrain::Material& material);

  /// Steps by `h` s; contacts, torques and forces are then used up. False when ODE had something to
  /// say: see message().
  bool Step(double h);
  /// ODE's first complaint, empty when there was none.
  std::string_view message() const { return message_; }

  // After a step: force (N) and moment (N·m) about the body's COM at the step's start, world axes,
  // of contact `index` in the order of the AddContact calls.
  Eigen::Vector3d contact_force(int index) const;
  Eigen::Vector3d contact_moment(int index) const;

 private:
  const robot::RobotModel& model_;
  dWorldID world_;
  dJointGroupID contacts_;
  std::vector<dBodyID> bodies_;
  std::vector<dJointID> hinges_;
  std::vector<double> turns_;  // by joint, rad to add to ODE's angle, a multiple of 2 pi
  std::vector<double> last_angle_;
  std::vector<dJointFeedback> feedback_;
  size_t num_contacts_ = 0;
  char message_[160] = "";
};

}  // namespace poise
