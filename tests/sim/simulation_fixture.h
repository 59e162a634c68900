// Shared by the simulator's tests: the paper's robot, variants of it, and a controller that just
// holds a posture.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>

#include "components/framework/configuration/configuration.h"
#include "components/robot/dynamics.h"
#include "components/robot/robot_model.h"
#include "components/robot_files/robot_files.h"
#include "sim/simulation.h"
#include "sim/start_posture.h"

namespace poise {

inline constexpr double kTick = 0.002;  // s

inline std::string RobotFolder() { return POISE_SOURCE_DIR "/deploy/robots/dyros/"; }

/// The paper's robot with its description edited, and with an ideal drive train: a test gives the
/// one that it is about.
inline robot::RobotModel EditedRobot(const std::function<void(Robot*)>& edit) {
  Robot description;
  ReadTextProto(RobotFolder() + "dyros_legs.pbtxt", &description);
  description.clear_drive_train();
  edit(&description);
  return robot::MakeRobot(description, ReadFile(RobotFolder() + "dyros_legs.urdf"));
}

inline robot::RobotModel PaperRobot() {
  return EditedRobot([](Robot*) {});
}

/// Joints so viscous that the robot is one rigid body for the length of a test.
inline robot::RobotModel RigidRobot() {
  return EditedRobot([](Robot* description) {
    for (auto& motor : *description->mutable_motor()) {
      motor.set_viscous_friction(1e9);
      motor.set_coulomb_friction(0);
      motor.set_static_friction(0);
    }
  });
}

inline SimConfig StandingConfig(const std::string& more = "") {
  SimConfig config;
  ParseTextProto(R"(start {
    nominal { joint: "right_hip_pitch" position: -0.4 } nominal { joint: "right_knee_pitch" position: 0.8 }
    nominal { joint: "right_ankle_pitch" position: -0.4 } nominal { joint: "left_hip_pitch" position: -0.4 }
    nominal { joint: "left_knee_pitch" position: 0.8 } nominal { joint: "left_ankle_pitch" position: -0.4 } } )" +
                     more,
                 "test", &config);
  return config;
}

/// Without noise, friction, armature and limits: rigid-body mechanics alone.
inline SimConfig BareConfig(const std::string& more = "") {
  return StandingConfig("joint_friction: false rotor_inertia: false torque_limits: false " + more);
}

/// Joint torques that hold the start posture: statics of the start plus a spring and damper at each
/// joint.
class PostureHolder {
 public:
  explicit PostureHolder(const Simulation& simulation, double stiffness = 2000, double damping = 60)
      : model_(simulation.model()),
        posture_(simulation.truth().state.joint_position),
        stiffness_(stiffness),
        damping_(damping) {
    robot::RobotData data(model_);
    const robot::RobotState& state = simulation.truth().state;
    robot::ComputeKinematics(model_, state, &data);
    robot::ComputeFeet(model_, &data);
    robot::ComputeDynamics(model_, state, &data);
    Eigen::VectorXd force = data.gravity;
    for (size_t f = 0; f < 2; ++f) {
      robot::Vector6d wrench = simulation.truth().foot_wrench[f];
      const Eigen::Matrix3d r = data.foot_pose[f].linear();
      wrench << r * wrench.head<3>(), r * wrench.tail<3>();
      force -= data.foot_jacobian[f].transpose() * wrench;
    }
    unbalanced_ = force.head<6>();
    statics_ = force.tail(model_.num_joints());
  }

  Eigen::VectorXd Torque(const SimulationTruth& truth) const {
    return statics_ + stiffness_ * (posture_ - truth.state.joint_position) -
           damping_ * truth.state.joint_velocity;
  }
  void Apply(Simulation* simulation) const { ApplyTorque(Torque(simulation->truth()), simulation); }
  static void ApplyTorque(const Eigen::VectorXd& torque, Simulation* simulation) {
    std::vector<double> current(static_cast<size_t>(torque.size()));
    const std::vector<int8_t> enabled(current.size(), 1);
    for (size_t j = 0; j < current.size(); ++j) {
      current[j] = torque[static_cast<Eigen::Index>(j)] /
                   simulation->model().motors()[j].torque_per_ampere();
    }
    simulation->SetCurrents(current, enabled);
  }
  const robot::Vector6d& unbalanced() const { return unbalanced_; }
  const Eigen::VectorXd& statics() const { return statics_; }

 private:
  robot::RobotModel model_;
  Eigen::VectorXd posture_, statics_;
  robot::Vector6d unbalanced_;
  double stiffness_, damping_;
};

}  // namespace poise
