// The simulated robot's world in ODE: the only file that talks to ODE.
#pragma once

#include <ode/ode.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string_view>
#include <vector>

#include "components/robot/robot_model.h"
#include "sim/world.h"
#include "sim_ode/sim_ode.pb.h"
#include "sim_ode/tree_step.h"

namespace poise {

/// How ODE softens a contact: its row is J v' + cfm lambda = -(erp / step) depth.
struct Softness {
  double erp;  ///< share of the penetration removed per step
  double cfm;  ///< m/(N·s)
};

/// A spring `k` (N/m) and a damper `d` (N·s/m) under implicit Euler with step `h` (s): ODE's
/// manual, "ERP and CFM".
Softness SpringDamper(double k, double d, double h);

/// ODE keeps bodies and joints. Its equations are solved by TreeStep, or by its own dWorldStep
/// (direct solver), as OdeConfig.solver says; both are first order in the step and repeatable bit
/// for bit. Where TreeStep gives up, dWorldStep takes the step. dWorldStep allocates.
class OdeWorld : public World {
 public:
  /// See WorldFactory. Throws ConfigError when ODE was built in single precision.
  OdeWorld(const OdeConfig& config, const robot::RobotModel& model, int max_contacts, double step);
  ~OdeWorld() override;
  OdeWorld(const OdeWorld&) = delete;
  OdeWorld& operator=(const OdeWorld&) = delete;

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

  int64_t given_up_steps() const { return given_up_steps_; }
  /// Times that the last step set the bounds of friction (TreeStep); 0 without contacts.
  int friction_rounds() const { return tree_.friction_rounds(); }

 private:
  Softness SoftnessOf(const ContactMaterial& material) const;
  bool StepTree();
  void StepDense();

  const robot::RobotModel& model_;
  double step_;
  Softness ground_;  // of contacts that are rigid
  dWorldID world_;
  dJointGroupID contacts_;
  std::vector<dBodyID> bodies_;
  std::vector<dJointID> hinges_;
  std::vector<double> turns_;  // by joint, rad to add to ODE's angle, a multiple of 2 pi
  std::vector<double> last_angle_;
  TreeStep tree_;
  bool dense_;
  size_t room_;                         // for contacts
  std::vector<TerrainContact> points_;  // of the next step
  std::vector<TreeStep::Contact> rows_;
  std::vector<dJointFeedback> feedback_;
  std::vector<Eigen::Vector3d> force_, moment_;  // of the contacts of the last step
  int64_t given_up_steps_ = 0;
  char message_[160] = "";
};

/// Worlds in ODE. Throws ConfigError with the path inside OdeConfig: a value out of range.
WorldFactory OdeWorlds(const OdeConfig& config);

}  // namespace poise
