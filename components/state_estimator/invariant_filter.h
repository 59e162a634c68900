// InvariantFilter: right-invariant extended Kalman filter of an IMU and two flat feet.
//
// Hartley, Ghaffari, Eustice, Grizzle: Contact-aided invariant extended Kalman filtering for robot
// state estimation, IJRR 2020, with the world-centric (right-invariant) error. The state is
// X = (R, v, p, d_right, d_left) in SE_4(3), IMU and soles' origins in the world, beside both IMU
// biases and, since soles are flat, each sole's rotation F in SO(3). Errors: ξ = log(X̂ X⁻¹), of a
// sole's rotation log(F̂ Fᵀ), of a bias estimate − truth. Without biases ξ propagates and is
// measured independently of the estimate. The last state is the gears' compliance, of which the
// readings of the soles depend: c, relative to what was assumed.
// docs/reference/estimation.md has the matrices.
#pragma once

#include <Eigen/Core>

#include "components/framework/state_archive.h"
#include "components/robot/foot.h"
#include "components/state_estimator/lie_group.h"

namespace poise {

/// Estimate of an InvariantFilter. World: z up.
struct InvariantState {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< IMU to world
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< m/s, of the IMU, world
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< m
  robot::FootArray<Eigen::Vector3d> foot{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  robot::FootArray<Eigen::Matrix3d> foot_rotation{Eigen::Matrix3d::Identity(),
                                                  Eigen::Matrix3d::Identity()};
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();           ///< rad/s, IMU frame
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< m/s²
  double compliance = 0;                                         ///< c; −0.2: 20 % stiffer
};

/// Readings that hold over a step, biases included.
struct ImuStep {
  Eigen::Vector3d angular_velocity;  ///< rad/s, IMU frame
  Eigen::Vector3d acceleration;      ///< m/s², IMU frame, specific force
  /// Covariance of their errors over the step, IMU frame: (rad/s)², (m/s²)².
  Eigen::Matrix3d angular_velocity_noise, acceleration_noise;
  double gyro_bias_walk = 0;           ///< rad/s/√s
  double accelerometer_bias_walk = 0;  ///< m/s²/√s
};

/// A sole seen from the IMU by the joints.
struct SoleReading {
  Eigen::Vector3d position;  ///< m, IMU frame
  Eigen::Matrix3d rotation;  ///< sole to IMU
  /// Covariance of its errors, [position; rotation vector], world axes.
  Eigen::Matrix<double, 6, 6> noise;
  /// How the same errors depend on the error of the compliance, and with which one it was read.
  Eigen::Matrix<double, 6, 1> by_compliance = Eigen::Matrix<double, 6, 1>::Zero();
  double compliance = 0;
};

class InvariantFilter {
 public:
  /// First of the three rows of each error in the covariance.
  static constexpr int kRotation = 0, kVelocity = 3, kPosition = 6, kFoot = 9, kGyroBias = 15,
                       kAccelerometerBias = 18, kFootRotation = 21, kCompliance = 27, kSize = 28;
  using Covariance = Eigen::Matrix<double, kSize, kSize>;
  using Error = Eigen::Matrix<double, kSize, 1>;

  /// Gravity in m/s², along −z.
  explicit InvariantFilter(double gravity) : gravity_(gravity) {}

  const InvariantState& state() const { return state_; }
  const Covariance& covariance() const { return covariance_; }
  /// `covariance` of ξ and the biases; rows of feet that are not held must be zero.
  void Set(const InvariantState& state, const Covariance& covariance);

  /// Integrates the readings over `dt` s: exactly for readings that are constant in the IMU frame;
  /// the covariance with the transition to second order in dt (exact but for the biases' columns)
  /// and noise to first order.
  void Propagate(const ImuStep& imu, double dt);
  /// Lets a held sole move: variances (m², rad²) by axis.
  void Loosen(robot::Foot foot, double position_variance, double rotation_variance);
  /// Adds to rotation (rad²), velocity ((m/s)²) and position (m²) what the readings cannot explain.
  void Doubt(double rotation_variance, double velocity_variance, double position_variance);

  /// Takes as known that `row` times the errors is 0 within `deviation`, a standard deviation: of
  /// what defines the world. The state stays as it is.
  void Know(const Error& row, double deviation);

  /// Takes a sole into the state where the reading sees it; what it was before is forgotten.
  void HoldPosition(robot::Foot foot, const SoleReading& reading);
  void HoldRotation(robot::Foot foot, const SoleReading& reading);
  /// Takes it out.
  void ReleasePosition(robot::Foot foot);
  void ReleaseRotation(robot::Foot foot);
  /// The sole in the world as IMU and joints show it, with the compliance as it is estimated.
  Eigen::Vector3d SeenPosition(const SoleReading& reading) const;
  Eigen::Matrix3d SeenRotation(const SoleReading& reading) const;
  bool holds_position(robot::Foot foot) const { return holds_position_[foot]; }
  bool holds_rotation(robot::Foot foot) const { return holds_rotation_[foot]; }

  /// Squared innovation of a held sole over its covariance: chi-squared with 3 degrees of freedom
  /// each when model and covariance hold. 0 for what is not held.
  struct Innovation {
    double position = 0, rotation = 0;
  };
  Innovation Test(robot::Foot foot, const SoleReading& reading) const;
  /// Takes a reading of what is held of a sole. False, and nothing changes, when the innovation's
  /// covariance is not positive definite.
  bool Correct(robot::Foot foot, const SoleReading& reading);

  void Archive(StateArchive* archive);

 private:
  static int FootRow(robot::Foot foot) { return kFoot + 3 * static_cast<int>(foot); }
  static int FootRotationRow(robot::Foot foot) {
    return kFootRotation + 3 * static_cast<int>(foot);
  }
  /// The error at row `to` becomes that at `from` plus `by_compliance` times the compliance's plus
  /// one of covariance `noise`.
  void CopyRows(int from, int to, const Eigen::Vector3d& by_compliance,
                const Eigen::Matrix3d& noise);
  void ClearRows(int row);
  template <int N>
  bool CorrectRows(const Eigen::Matrix<double, N, 1>& innovation,
                   const Eigen::Matrix<double, kSize, N>& covariance_h,
                   const Eigen::Matrix<double, N, N>& innovation_covariance);
  Eigen::Vector3d PositionInnovation(robot::Foot foot, const SoleReading& reading) const;
  Eigen::Vector3d RotationInnovation(robot::Foot foot, const SoleReading& reading) const;
  /// X̂ ← exp(−ξ) X̂, biases and soles' rotations likewise.
  void TakeOut(const Error& error);

  double gravity_;
  InvariantState state_;
  Covariance covariance_ = Covariance::Zero();
  robot::FootArray<bool> holds_position_{}, holds_rotation_{};
};

}  // namespace poise
