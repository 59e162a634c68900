// The simulated robot's world in MuJoCo: with mujoco_model, the only files that talk to MuJoCo.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string_view>
#include <vector>

#include "components/robot/robot_model.h"
#include "sim/world.h"
#include "sim_mujoco/mujoco_model.h"
#include "sim_mujoco/sim_mujoco.pb.h"

namespace poise {

/// How a contact point answers along one direction, in MuJoCo's form: its velocity v' at the step's
/// end obeys v' = target - softness * force.
struct ContactLaw {
  double target;    ///< m/s
  double softness;  ///< m/(N·s)
};

/// A spring `k` (N/m) and a damper `d` (N·s/m) that a point has entered by `depth` (m), under
/// implicit Euler with step `h` (s): force = k (depth - h v') - d v'.
ContactLaw SpringDamperLaw(double k, double d, double depth, double h);

/// MuJoCo's dynamics and its Newton solver with elliptic cones, to convergence. What differs from
/// mj_step:
///  - A joint row (JointRow) is part of the mass matrix, as armature of h / cfm: the law in the
///    velocity at the step's end is then exact, and contacts are solved at once with it.
///  - Contacts obey a ContactLaw in place of solref and solimp.
///  - A contact that slides does not push itself off the ground (Coulomb's law; MuJoCo's cone of
///    forces alone would lift it by friction times the slip).
///  - The robot's COM moves by the forces on it, exactly.
/// docs/reference/engines.md derives them. First order in the step; repeatable bit for bit.
class MujocoWorld : public World {
 public:
  /// See WorldFactory.
  MujocoWorld(const MujocoConfig& config, const robot::RobotModel& model, int max_contacts,
              double step);
  MujocoWorld(const MujocoWorld&) = delete;
  MujocoWorld& operator=(const MujocoWorld&) = delete;

  void SetState(const robot::RobotState& state) override;
  void GetState(robot::RobotState* state) const override;
  double joint_position(int joint) const override;
  double joint_velocity(int joint) const override;
  Eigen::Vector3d com_position(int body) const override;
  Eigen::Vector3d com_velocity(int body) const override;
  Eigen::Matrix3d rotation(int body) const override;
  Eigen::Vector3d angular_velocity(int body) const override;
  Eigen::Isometry3d pose(int body) const override;
  bool Finite() const override;

  void SetJoint(int joint, const JointRow& row) override;
  void AddForce(int body, const Eigen::Vector3d& force, const Eigen::Vector3d& point) override;
  void AddContact(const TerrainContact& contact) override;
  bool Step() override;
  std::string_view message() const override { return message_; }
  Eigen::Vector3d contact_force(int index) const override;
  Eigen::Vector3d contact_moment(int index) const override;

  /// Coulomb's law took that many solutions in the last step.
  int solutions() const { return solutions_; }
  /// Steps since construction in which that many were not enough: the last one was taken.
  int unsolved_steps() const { return unsolved_steps_; }

 private:
  struct Contact {
    TerrainContact at;
    ContactLaw law;      // along the normal, the surface's velocity included
    double slip;         // m/s, at which it is taken to slide
    double slip_change;  // m/s, that the last solution asks for
    Eigen::Vector3d com, force, moment;
  };

  struct SlipChange {
    double largest = 0;  // of a point, over what may remain
    double along = 0,
           difference = 0;  // (m/s)², of all points: change before · (now - before), |..|²
  };

  void Advance();
  void AddContacts();
  void SetLaws();
  Eigen::Vector3d PointBias(const TerrainContact& at) const;
  void SetNormalReference(const Contact& contact, int row);
  void SolveContacts();
  SlipChange FindSlipChange();
  void CorrectSlip(double pace);
  void ReadContacts();
  void Integrate();
  void MoveRobot(const Eigen::Vector3d& distance, const Eigen::Vector3d& velocity);
  void UpdateKinematics();
  Eigen::Vector3d RobotVelocity() const;

  const robot::RobotModel& model_;
  double step_;
  double time_constant_, softness_;
  MujocoRobot robot_;
  MujocoDataPtr data_;
  std::vector<Contact> contacts_;
  size_t num_contacts_ = 0;  // of the step to come, or of the last one
  bool stepped_ = false;     // since contacts were added
  Eigen::Vector3d applied_force_ = Eigen::Vector3d::Zero();  // N, sum of AddForce
  int solutions_ = 0, unsolved_steps_ = 0;
  char message_[160] = "";
};

/// Worlds in MuJoCo. Throws ConfigError with the path inside MujocoConfig: a value out of range.
WorldFactory MujocoWorlds(const MujocoConfig& config);

}  // namespace poise
