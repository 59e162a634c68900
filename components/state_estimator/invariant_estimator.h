// InvariantEstimator: position, orientation and velocity of the floating base, with their
// covariance, by an InvariantFilter of the IMU and the soles that stand.
//
// Measured load with hysteresis decides which soles stand, the centre of pressure whether a sole
// stands flat (its rotation is then a measurement, too), the innovation whether it stands still: a
// sole that slips, sinks or turns is let loose until it has come to rest. Joints are read at the
// motors: the gears' windup under the measured torque is taken out with a compliance that is
// estimated, too; friction's part of it remains as a walk of the soles. The readings are
// sensor_delay old; what is published is predicted to the present.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>

#include "components/framework/state_archive.h"
#include "components/state_estimator/base_sensors.h"
#include "components/state_estimator/invariant_filter.h"
#include "components/state_estimator/low_pass.h"
#include "components/state_estimator/sole_kinematics.h"
#include "components/state_estimator/state_estimator.pb.h"

namespace poise {

/// Numbered as CONTACT_* of ESTIMATOR_STATUS.
enum class FootContact : int8_t { kNone, kFirm, kSlipping };

class InvariantEstimator {
 public:
  /// Rows are (estimate − truth) of base orientation, linear velocity, position, world axes.
  using BaseCovariance = Eigen::Matrix<double, 9, 9>;

  /// `period` s, nominal, > 0: steps are taken to last from a tenth of it to 1 s.
  InvariantEstimator(std::shared_ptr<const robot::RobotModel> model,
                     const StateEstimatorConfig& config, double period);

  /// Takes the next readings, `dt` s after the last. The first call places the robot as
  /// PlaceOnGround says, at rest. Any finite input gives a finite state. Allocates nothing.
  void Update(const BaseSensors& sensors, double dt);

  void Archive(StateArchive* archive);

  /// Base and joints, predicted by sensor_delay; joint velocities filtered.
  const robot::RobotState& state() const { return state_; }
  const BaseCovariance& covariance() const { return base_covariance_; }
  const InvariantFilter& filter() const { return filter_; }
  /// Share of each foot in what stands, 0..1, as WeighFeet says.
  const robot::FootArray<double>& foot_weight() const { return foot_weight_; }
  FootContact contact(robot::Foot foot) const;
  /// Squared normalised innovation of the sole's position before the correction; 0 out of contact.
  double innovation(robot::Foot foot) const { return feet_[foot].innovation; }
  /// The sole in the world.
  Eigen::Isometry3d foot_pose(robot::Foot foot) const;

 private:
  struct FootState {
    bool loaded = false;
    double slip_left = 0, turn_left = 0;  // s, until it may stand still again; 0: it does
    double slip_time = 0;                 // s, since it began to slip
    Eigen::Vector3d slip_start = Eigen::Vector3d::Zero();   // where the present rest began
    Eigen::Vector3d apart_start = Eigen::Vector3d::Zero();  // m, to the other sole then
    Eigen::Matrix3d turn_start = Eigen::Matrix3d::Identity();
    double innovation = 0;
    // Mean of the squared innovation over what is expected: above 1 the readings are worse than
    // their noise says (a gear that rings), and the noise is taken to be so much larger.
    double excess = 1;
    SoleReading reading;  // of this step
  };

  void ReadJoints(const BaseSensors& sensors, double dt);
  void ReadImu(const BaseSensors& sensors);
  void ReadSoles();
  /// The filter with standard deviations of rotation (rad), velocity (m/s) and position (m), and of
  /// the biases and the compliance as at the start.
  void Begin(const InvariantState& state, double turn, double speed, double position);
  void Place(const BaseSensors& sensors);
  void DefineWorld(const FootWeights& weights);
  void Propagate(double dt);
  void Recover(bool finite);
  void UpdateContacts(const BaseSensors& sensors);
  void Correct(double dt);
  void LetSlip(robot::Foot foot);
  void LetTurn(robot::Foot foot);
  void ComeToRest(robot::Foot foot, bool other_stands, double dt);
  void BeginRest(robot::Foot foot);
  /// From this foot's sole to the other one's, m, world.
  Eigen::Vector3d Apart(robot::Foot foot) const;
  void Publish();

  std::shared_ptr<const robot::RobotModel> model_;
  InvariantEkfConfig config_;
  double gyro_noise_, accelerometer_noise_;  // rad/s, m/s², per sample
  double period_;
  double weight_;                    // N, of the robot
  Eigen::VectorXd encoder_noise_;    // rad, standard deviation by joint
  Eigen::VectorXd torque_, unrest_;  // N·m, read, and what of it the gears do not yet carry
  LowPass velocity_filter_;
  SoleKinematics kinematics_;
  InvariantFilter filter_;
  Eigen::VectorXd joint_position_, link_position_, joint_rate_;  // rad, rad, rad/s, read
  robot::RobotState state_;
  BaseCovariance base_covariance_ = BaseCovariance::Zero();
  robot::FootArray<FootState> feet_;
  robot::FootArray<double> foot_weight_{};
  // Readings of this step and of the one before: rad/s, m/s², IMU frame.
  Eigen::Vector3d gyro_ = Eigen::Vector3d::Zero(), last_gyro_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero(), last_force_ = Eigen::Vector3d::Zero();
  bool imu_good_ = true, last_imu_good_ = true;
  bool placed_ = false;
};

}  // namespace poise
