// WrenchObserver: the feet's wrenches from joint torques, IMU, encoders and the model, with their
// covariance: a momentum observer.
//
// The generalised momentum p = A v obeys p' = τ − friction + (C' v − g) + Jᵀ w: what moves it and
// is not known comes from the ground. All readings pass one low-pass, whose derivatives of the
// joints' positions and of the gyro are those of p; so all rows are of the same instant, and no
// reading is differentiated without being filtered. In the base's frame the accelerometer holds
// both the base's acceleration and gravity: neither orientation nor velocity of the base enters.
// The legs' joint rows tell each foot's wrench, as far as friction lets them; the six rows of the
// base tell the sum of both, unless something pushes the robot, which shows as a disagreement and
// takes their weight.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "components/framework/state_archive.h"
#include "components/robot/dynamics.h"
#include "components/state_estimator/base_sensors.h"
#include "components/state_estimator/joint_errors.h"
#include "components/state_estimator/low_pass.h"

namespace poise {

/// Hz, of the second-order low-pass that all readings pass: above it encoder steps become forces,
/// below it a touch-down is seen late.
inline constexpr double kObserverCutoff = 40;

/// What else the readings are known to hold, and the robot to carry.
struct ObserverCorrection {
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();           ///< rad/s, IMU frame
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< m/s², IMU frame
  double load_mass = 0;                                          ///< kg
  Eigen::Vector3d load_moment = Eigen::Vector3d::Zero();         ///< kg·m, base frame
};

class WrenchObserver {
 public:
  /// Both feet have [force; moment] each, right first.
  using Wrenches = Eigen::Matrix<double, 12, 1>;
  using Covariance = Eigen::Matrix<double, 12, 12>;

  /// `cutoff`: Hz, of the low-pass that all readings pass.
  explicit WrenchObserver(std::shared_ptr<const robot::RobotModel> model,
                          double cutoff = kObserverCutoff);

  /// Takes the readings of a tick, `dt` s after the last. The first are taken to be those of a
  /// robot at rest. Allocates nothing, as Observe.
  void Track(const BaseSensors& sensors, double dt);
  /// Finds the wrenches from what has been read. False, and nothing changes, when it holds no
  /// finite number. `learn`: what a free foot's joints show is learnt.
  bool Observe(const ObserverCorrection& correction, bool learn = false);

  /// Robot on environment, each in its sole's frame, N and N·m.
  const Wrenches& wrenches() const { return wrenches_; }
  const Covariance& covariance() const { return covariance_; }
  /// The covariance without what the low-pass lags behind, as it is of wrenches that do not change.
  /// It is as small as what the foot seemed to carry where that hangs free, or did a moment ago.
  const Covariance& settled_covariance() const { return settled_covariance_; }
  /// Whether the foot was seen to hang free at the last Observe that learns.
  bool free(robot::Foot foot) const { return free_foot_[foot].free(); }
  /// Whether a joint torque is known; without, the base's rows alone tell the sum of both feet.
  bool torque_known() const { return torque_known_; }
  /// Squared normalised disagreement of the base's rows with the legs': chi-squared with 6 degrees
  /// of freedom when nothing but the feet touches the robot.
  double push_excess() const { return push_excess_; }
  /// Whether that is beyond chance: something pushes the robot.
  bool pushed() const;
  /// The last Observe found these, in the base frame, without the load: specific force of the
  /// base's origin (acceleration less gravity, m/s²), and the force and moment about the base's
  /// origin that the model asks of the ground (N, N·m).
  const Eigen::Vector3d& specific_force() const { return base_force_; }
  const Eigen::Vector3d& base_turn() const { return base_acceleration_; }  ///< rad/s²
  const robot::Vector6d& base_wrench() const { return base_wrench_; }
  const robot::RobotData& data() const { return data_; }
  /// m from the base's origin, and rotation: the sole in the base frame.
  const Eigen::Vector3d& sole_position(robot::Foot foot) const { return sole_position_[foot]; }
  const Eigen::Matrix3d& sole_rotation(robot::Foot foot) const { return sole_rotation_[foot]; }
  void Archive(StateArchive* archive);

 private:
  void ReadMotion(const ObserverCorrection& correction);
  void AddLoad(const ObserverCorrection& correction);
  void InverseDynamics();
  void TrackFriction(double dt);
  void AddJointRows();
  bool AddBaseRows();
  void Learn(double dt);

  std::shared_ptr<const robot::RobotModel> model_;
  std::vector<int> leg_joints_;
  std::vector<robot::FootArray<bool>> supports_;  // by leg joint: of which feet
  LowPass filter_;                                // positions, gyro, accelerometer, torques
  Eigen::VectorXd input_;
  robot::RobotState state_;  // of the filter, base at the origin
  robot::RobotData data_;
  Eigen::Vector3d base_force_ = Eigen::Vector3d::Zero();         // m/s²
  Eigen::Vector3d base_acceleration_ = Eigen::Vector3d::Zero();  // rad/s²
  std::vector<Eigen::Vector3d> linear_, angular_;  // by body: m/s², rad/s², gravity as acceleration
  std::vector<Eigen::Vector3d> force_, moment_;    // by body and all it carries
  Eigen::VectorXd joint_torque_;                   // N·m, that the motion asks for
  Eigen::Vector3d com_ = Eigen::Vector3d::Zero();  // m, from the base's origin
  double mass_ = 0;                                // kg
  robot::Vector6d base_wrench_ = robot::Vector6d::Zero();
  robot::FootArray<Eigen::Vector3d> sole_position_;
  robot::FootArray<Eigen::Matrix3d> sole_rotation_;
  Wrenches wrenches_ = Wrenches::Zero(), rate_ = Wrenches::Zero(), estimate_ = Wrenches::Zero();
  Covariance covariance_ = Covariance::Identity(), spread_ = Covariance::Identity();
  Covariance settled_covariance_ = Covariance::Identity();
  // By leg joint, N·m: what friction holds, and its standard deviation. A joint that has slipped
  // one way still holds it when it sticks, until it is bent back. Before the first slip it may be
  // anything up to break-away.
  Eigen::VectorXd bristle_, bristle_error_;
  Eigen::VectorXd noise_;  // (N·m)², by leg joint: the row's variance at least
  JointErrors errors_;     // by leg joint
  std::vector<JointErrors::Torques> torques_;  // by leg joint, of this Observe
  Eigen::VectorXd residual_, variance_;        // N·m, (N·m)², by leg joint, of this Observe
  robot::FootArray<FreeFoot> free_foot_;
  // Square of what a free foot seems to carry over its variance, at most 1.
  robot::FootArray<double> fit_ = {1, 1};
  Eigen::Vector3d between_ = Eigen::Vector3d::Zero();  // m, from right to left sole, right's axes
  double push_excess_ = 0;
  double since_ = 0;  // s, since the last Observe
  bool torque_known_ = false, started_ = false, observed_ = false;
};

}  // namespace poise
