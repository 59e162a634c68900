// Rigid-body kinematics and dynamics of a RobotModel: const model, mutable data, no allocation
// after construction.
//
// All spatial quantities are taken about the base frame's origin in world axes, so that nothing
// loses precision far from the world's origin. Point results (com, poses) are in the world frame.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "components/robot/robot_model.h"

namespace poise::robot {

using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Results, sized once for a model; which function fills what stands beside each member. n =
/// num_joints + 6.
struct RobotData {
  explicit RobotData(const RobotModel& model);

  // ComputeKinematics
  std::vector<Eigen::Matrix3d> body_rotation;  ///< body to world
  std::vector<Eigen::Vector3d>
      body_position;  ///< m, body frame's origin relative to the base origin, world axes
  std::vector<Eigen::Vector3d> joint_axis;             ///< unit, world axes, by joint
  std::vector<Eigen::Vector3d> body_angular_velocity;  ///< rad/s, world axes
  std::vector<Eigen::Vector3d>
      body_linear_velocity;                        ///< m/s, of the body frame's origin, world axes
  std::vector<Eigen::Vector3d> body_angular_bias;  ///< rad/s², angular acceleration at v̇ = 0
  std::vector<Eigen::Vector3d> body_linear_bias;   ///< m/s², of the body frame's origin at v̇ = 0
  Eigen::Vector3d base_position;                   ///< m, world

  // ComputeFeet (sole frame's origin; rows: linear, angular; world axes)
  FootArray<Eigen::Isometry3d> foot_pose;      ///< sole frame in the world
  FootArray<Matrix6X> foot_jacobian;           ///< 6×n
  FootArray<Vector6d> foot_velocity;           ///< m/s, rad/s
  FootArray<Vector6d> foot_bias_acceleration;  ///< J̇ v of the sole: m/s², rad/s²

  // ComputeDynamics
  Eigen::MatrixXd mass_matrix;   ///< A, n×n, reflected rotor inertia included
  Eigen::VectorXd bias;          ///< b, n×1, Coriolis and centrifugal
  Eigen::VectorXd gravity;       ///< g, n×1
  double total_mass = 0;         ///< kg, with the state's load
  Eigen::Vector3d com;           ///< m, world
  Eigen::Vector3d com_velocity;  ///< m/s
  Eigen::Matrix<double, 3, Eigen::Dynamic> com_jacobian;  ///< 3×n
  Eigen::Vector3d com_bias_acceleration;                  ///< J̇_com v, m/s²

  // Scratch of ComputeDynamics: sums over the bodies a body carries, about the base origin, world
  // axes.
  struct Subtree {
    Eigen::Vector3d first_moment;  ///< kg·m
    Eigen::Vector3d force;         ///< N, to accelerate at v̇ = 0
    Eigen::Vector3d moment;        ///< N·m, likewise
    Eigen::Matrix3d inertia;       ///< kg·m²; lower triangle only
  };
  std::vector<Subtree> subtree;
};

/// Positions, velocities and velocity-product accelerations of all bodies.
/// Precondition: state sized for the model, unit quaternion. Never throws; non-finite input gives
/// non-finite output.
void ComputeKinematics(const RobotModel& model, const RobotState& state, RobotData* data);

/// Sole poses, velocities, Jacobians and J̇ v. Requires ComputeKinematics.
void ComputeFeet(const RobotModel& model, RobotData* data);

/// Mass matrix (composite rigid bodies), bias (Newton–Euler), gravity and COM quantities.
/// Requires ComputeKinematics with the same state.
void ComputeDynamics(const RobotModel& model, const RobotState& state, RobotData* data);

/// All of the above of one state.
RobotData Evaluate(const RobotModel& model, const RobotState& state);
/// With the base at the origin, upright, everything at rest. `joint_position`: rad, n×1.
RobotData Evaluate(const RobotModel& model, const Eigen::VectorXd& joint_position);

/// Jacobian (6×n, linear over angular, world axes) of a point fixed to `body`; `point` in the body
/// frame, m. Requires ComputeKinematics.
void ComputePointJacobian(const RobotModel& model, const RobotData& data, int body,
                          const Eigen::Vector3d& point, Eigen::Ref<Matrix6X> jacobian);

/// Generalised force A v̇ + b + g from Newton's and Euler's laws body by body, without mass matrix
/// or composite bodies: a check of ComputeDynamics that shares no formula with it. Requires
/// ComputeKinematics.
void InverseDynamics(const RobotModel& model, const RobotState& state, const RobotData& data,
                     const Eigen::Ref<const Eigen::VectorXd>& acceleration,
                     Eigen::Ref<Eigen::VectorXd> generalized_force);

}  // namespace poise::robot
