// Where soles and IMU are in the base frame, and where the base is when the soles stand on the
// ground.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "components/robot/dynamics.h"

namespace poise {

/// A sole in the base frame.
struct Sole {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< m
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< sole to base
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< m/s, of its origin
};

/// Kinematics with the base held at the origin: all in the base frame. Allocates nothing after
/// construction.
class SoleKinematics {
 public:
  explicit SoleKinematics(std::shared_ptr<const robot::RobotModel> model);

  /// `position` rad, `velocity` rad/s, by joint.
  void Update(const Eigen::Ref<const Eigen::VectorXd>& position,
              const Eigen::Ref<const Eigen::VectorXd>& velocity);

  const Sole& sole(robot::Foot foot) const { return soles_[foot]; }
  const Eigen::Matrix3d& imu_rotation() const { return imu_rotation_; }  ///< IMU to base
  const Eigen::Vector3d& imu_position() const { return imu_position_; }  ///< m
  const Eigen::Vector3d& imu_velocity() const { return imu_velocity_; }  ///< m/s
  /// rad/s, of the IMU; not zero only with joints between it and the base.
  const Eigen::Vector3d& imu_angular_velocity() const { return imu_angular_velocity_; }

  /// What rates of the joints (rad/s) make of a sole's motion relative to the IMU, in base axes:
  /// column of joint `joint` of the 6×n Jacobian, linear (of the sole's origin, for an observer who
  /// turns with the IMU) over angular. Zero for a joint between neither.
  robot::Vector6d RelativeColumn(robot::Foot foot, int joint) const {
    const auto j = static_cast<size_t>(joint);
    const Eigen::Vector3d& axis = data_.joint_axis[j];
    const Eigen::Vector3d& origin = data_.body_position[j + 1];  // of the joint's child
    robot::Vector6d column;
    // A joint below the IMU turns the observer: what it moves then moves the other way for it.
    column << axis.cross(soles_[foot].position - origin), axis;
    return sign_[foot][j] * column;
  }
  /// Joints with a column that is not zero.
  const std::vector<int>& joints(robot::Foot foot) const { return joints_[foot]; }

 private:
  std::shared_ptr<const robot::RobotModel> model_;
  robot::RobotState state_;  // base at the origin and at rest
  robot::RobotData data_;
  robot::FootArray<Sole> soles_;
  robot::FootArray<std::vector<int>> joints_;
  robot::FootArray<std::vector<double>>
      sign_;  // by joint: 1 between base and sole, −1 base and IMU
  Eigen::Matrix3d imu_rotation_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d imu_position_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d imu_velocity_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d imu_angular_velocity_ = Eigen::Vector3d::Zero();
};

/// How far feet stand by their loads.
struct FootWeights {
  robot::FootArray<double> grip{};   ///< 0: light; 1: stands
  robot::FootArray<double> share{};  ///< among the gripping feet, sums to 1; 0 when none grips
  double standing = 0;               ///< 0: in flight; 1: the robot stands
};
/// `load`: N, upward force on each sole; `robot_weight` N. A foot grips from a twentieth of the
/// weight on and fully from a fifth on; half is a foot's in even standing.
FootWeights WeighFeet(const robot::FootArray<double>& load, double robot_weight);

struct Placement {
  Eigen::Matrix3d orientation = Eigen::Matrix3d::Identity();  ///< base to world
  Eigen::Vector3d position = Eigen::Vector3d::Zero();         ///< m, of the base
};
/// The base in the world when the soles that carry load stand flat on level ground (without load
/// the lower one, or both): z = 0 at their height, the midpoint between the soles at x = y = 0, y
/// along the line from the right to the left sole.
Placement PlaceOnGround(const SoleKinematics& kinematics, const FootWeights& weights);

/// One Newton step to the nearest rotation: undoes the rounding of a step.
Eigen::Matrix3d Orthonormal(const Eigen::Matrix3d& m);

}  // namespace poise
