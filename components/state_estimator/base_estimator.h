// BaseEstimator: position, orientation and velocity of the floating base from IMU, encoders and the
// loads of the feet.
//
// The robot is taken to be at rest at first: what the gyro reads then is its bias, at once from the
// first reading and, when encoders and loads stay steady, from the mean of the first 0.2 s.
// Orientation integrates the gyro and follows slowly the orientation that the stance feet's
// kinematics give, and very slowly gravity. Position and velocity follow the loaded feet, which
// stand; a foot without load moves along with the base estimate and its anchor with it. Only
// measured load decides: no contact schedule is known. Two loaded feet that disagree share the
// disagreement between their anchors over anchor_time_constant, without moving the weighted mean:
// that lets a foot sink into soft ground. A foot that turns by more than foot_rotation_tolerance
// while the gyro and the other foot do not is re-anchored where it comes to rest. A single loaded
// foot is the world: its sinking is not observable and shows as the ground rising with it. With no
// foot loaded the IMU is integrated.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>

#include "components/framework/state_archive.h"
#include "components/robot/dynamics.h"
#include "components/state_estimator/base_sensors.h"
#include "components/state_estimator/low_pass.h"
#include "components/state_estimator/sole_kinematics.h"
#include "components/state_estimator/state_estimator.pb.h"

namespace poise {

class BaseEstimator {
 public:
  /// `period` s, nominal, > 0: steps are taken to last from a tenth of it to 1 s.
  BaseEstimator(std::shared_ptr<const robot::RobotModel> model, const StateEstimatorConfig& config,
                double period);

  /// Takes the next readings, `dt` s after the last. The first call places the robot: loaded feet
  /// flat on level ground (without load the lower one, or both), z = 0 at their height, the
  /// midpoint between the soles at x = y = 0, y along the line from the right to the left sole; at
  /// rest. Any finite input gives a finite state. Allocates nothing.
  void Update(const BaseSensors& sensors, double dt);

  /// Shows all that lasts from step to step.
  void Archive(StateArchive* archive);

  /// Base and joints; joint velocities filtered.
  const robot::RobotState& state() const { return state_; }
  /// Weight of each foot as an anchor, 0..1; their sum falls below 1 as the robot leaves the
  /// ground.
  const robot::FootArray<double>& foot_weight() const { return foot_weight_; }
  const Eigen::Vector3d& gyro_bias() const { return gyro_bias_; }  ///< rad/s, IMU frame
  /// m/s², IMU frame: what the accelerometer reads on average beyond gravity, as the orientation
  /// has it. It has no effect on the state.
  const Eigen::Vector3d& accelerometer_bias() const { return accelerometer_bias_; }
  /// Sole in the world: where the estimator holds it to stand, and where the kinematics see it.
  const Eigen::Isometry3d& anchor(robot::Foot foot) const { return feet_[foot].anchor; }
  Eigen::Isometry3d foot_pose(robot::Foot foot) const;

 private:
  struct FootState {
    // m, world axes: from the base's origin to the sole, in the step before.
    Eigen::Vector3d last_offset;
    Eigen::Isometry3d anchor;  ///< in the world
    Eigen::Vector3d turn;      ///< rad, from its present orientation to the anchor's, world axes
    double trust = 1;   ///< 1: its orientation agrees with gyro or other foot; 0: it has turned
    double grip = 0;    ///< 0: light, follows the base; 1: stands
    double weight = 0;  ///< among the gripping feet, sums to 1; 0 when none grips
  };

  void UpdateJoints(const BaseSensors& sensors, double dt);
  void UpdateWeights(const BaseSensors& sensors);
  void Place(const BaseSensors& sensors);
  void StartGyroBias(const BaseSensors& sensors);
  void AverageGyroBias(const BaseSensors& sensors, double dt);
  void ReadImu(const BaseSensors& sensors);
  void UpdateOrientation(const BaseSensors& sensors, double dt);
  void UpdateTrust();
  void UpdatePosition(double dt);
  void UpdateAnchors(double dt);
  void AverageAccelerometer(const BaseSensors& sensors, double dt);

  std::shared_ptr<const robot::RobotModel> model_;
  StateEstimatorConfig config_;
  double period_;
  double weight_;  // N, of the robot
  LowPass velocity_filter_;
  SoleKinematics kinematics_;
  robot::RobotState state_;
  Eigen::VectorXd joint_rate_;  // rad/s, unfiltered
  Eigen::Matrix3d orientation_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias_ = Eigen::Vector3d::Zero();
  double averaged_ = 0;  // s, of the accelerometer's readings
  Eigen::Quaterniond imu_orientation_ = Eigen::Quaterniond::Identity();  // IMU to world
  Eigen::Vector3d gyro_ = Eigen::Vector3d::Zero();  // rad/s, without bias, IMU frame
  // This step has in the base frame: IMU to base; rate of the base, rad/s; velocity of the IMU
  // relative to the base's origin, m/s; specific force, m/s².
  Eigen::Matrix3d imu_rotation_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d angular_velocity_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d imu_velocity_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d imu_acceleration_ = Eigen::Vector3d::Zero();
  // The step before had these, in world axes.
  Eigen::Vector3d last_imu_velocity_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_acceleration_ = Eigen::Vector3d::Zero();
  robot::FootArray<FootState> feet_;
  robot::FootArray<double> foot_weight_{};
  double grip_ = 0;  // 0: in flight, 1: standing
  // The readings at rest: of the first step, and their sum, over `rest_left_` s more.
  Eigen::VectorXd rest_position_;
  robot::FootArray<double> rest_load_{};
  Eigen::Vector3d rest_gyro_ = Eigen::Vector3d::Zero();
  int rest_samples_ = 0;
  double rest_left_ = 0;
  bool placed_ = false;
};

}  // namespace poise
