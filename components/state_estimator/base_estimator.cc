#include "components/state_estimator/base_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using robot::Foot;
using robot::kFeet;

// No robot exceeds these: they keep every finite reading from making a number that is not.
constexpr double kMaxRate = 100;          // rad/s, gyro and joints
constexpr double kMaxAcceleration = 1e3;  // m/s²
constexpr double kMaxSpeed = 100;         // m/s
constexpr double kLongestStep = 1;        // s: what lies further back is not extrapolated
constexpr double kMaxGyroBias = 0.05;     // rad/s: any larger is a broken sensor, not a bias
// At rest: for this long, s, no joint leaves its first position by more, rad (a few encoder
// counts), and no foot its first load, share of the weight.
constexpr double kRestTime = 0.2;
constexpr double kRestJointMotion = 1e-4;
constexpr double kRestLoadChange = 0.02;
constexpr double kBiasTime = 5;  // s, over which the accelerometer is averaged

Vector3d Clamp(const Vector3d& v, double limit) { return v.cwiseMin(limit).cwiseMax(-limit); }

// Share of a first-order approach with `time_constant` in one step.
double Approach(double dt, double time_constant) { return dt / (time_constant + dt); }

Quaterniond Exp(const Vector3d& rotation) {
  const double angle = rotation.norm();
  const double half_sinc = angle > 1e-9 ? std::sin(angle / 2) / angle : 0.5;
  const Vector3d v = half_sinc * rotation;
  return {std::cos(angle / 2), v.x(), v.y(), v.z()};
}

// Rotation from `from` to `to`, world axes: axis times the sine of the angle. The angles are small;
// beyond a right angle it falls off, but stays finite and of the right sign.
Vector3d RotationError(const Matrix3d& to, const Matrix3d& from) {
  const Matrix3d e = to * from.transpose();
  return 0.5 * Vector3d(e(2, 1) - e(1, 2), e(0, 2) - e(2, 0), e(1, 0) - e(0, 1));
}

}  // namespace

BaseEstimator::BaseEstimator(std::shared_ptr<const robot::RobotModel> model,
                             const StateEstimatorConfig& config, double period)
    : model_(std::move(model)),
      config_(config),
      period_(period),
      weight_(model_->total_mass() * robot::kGravity),
      velocity_filter_(model_->num_joints(), config.joint_velocity_cutoff()),
      kinematics_(model_),
      state_(model_->num_joints()),
      joint_rate_(Eigen::VectorXd::Zero(model_->num_joints())),
      rest_position_(Eigen::VectorXd::Zero(model_->num_joints())) {
  for (FootState& foot : feet_) foot.anchor.setIdentity();
}

Eigen::Isometry3d BaseEstimator::foot_pose(Foot foot) const {
  const FootState& f = feet_[foot];
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = orientation_ * kinematics_.sole(foot).rotation;
  pose.translation() = state_.base_position + f.last_offset;
  return pose;
}

void BaseEstimator::Update(const BaseSensors& sensors, double dt) {
  dt = std::clamp(dt, 0.1 * period_, std::max(kLongestStep, period_));
  UpdateJoints(sensors, dt);
  kinematics_.Update(state_.joint_position, state_.joint_velocity);
  UpdateWeights(sensors);
  if (!placed_) {
    Place(sensors);
    placed_ = true;
  } else {
    AverageGyroBias(sensors, dt);
    UpdateOrientation(sensors, dt);
    UpdatePosition(dt);
    UpdateAnchors(dt);
  }
  state_.base_angular_velocity = orientation_ * angular_velocity_;
  AverageAccelerometer(sensors, dt);
}

// Over time the robot does not accelerate: the average beyond gravity is bias, or the IMU's tilt.
void BaseEstimator::AverageAccelerometer(const BaseSensors& sensors, double dt) {
  const Vector3d up = (orientation_ * imu_rotation_).transpose() * Vector3d::UnitZ();
  const Vector3d beyond = Clamp(sensors.acceleration, kMaxAcceleration) - robot::kGravity * up;
  averaged_ = std::min(averaged_ + dt, kBiasTime);
  accelerometer_bias_ += std::min(dt / averaged_, 1.0) * (beyond - accelerometer_bias_);
}

void BaseEstimator::Archive(StateArchive* archive) {
  velocity_filter_.Archive(archive);
  archive->Show(state_.base_position, state_.base_orientation, state_.base_linear_velocity,
                state_.base_angular_velocity, state_.joint_position, state_.joint_velocity,
                orientation_, gyro_bias_, imu_orientation_, gyro_, imu_rotation_, angular_velocity_,
                imu_velocity_, imu_acceleration_);
  for (FootState& foot : feet_) archive->Show(foot.last_offset, foot.anchor);
  archive->Show(accelerometer_bias_, averaged_, foot_weight_, rest_position_, rest_load_,
                rest_gyro_, rest_samples_, rest_left_, placed_);
}

void BaseEstimator::UpdateJoints(const BaseSensors& sensors, double dt) {
  if (placed_) {
    joint_rate_ = ((sensors.joint_position - state_.joint_position) / dt)
                      .cwiseMin(kMaxRate)
                      .cwiseMax(-kMaxRate);
    velocity_filter_.Step(joint_rate_, dt);
  }
  state_.joint_position = sensors.joint_position;
  state_.joint_velocity = velocity_filter_.value();
}

void BaseEstimator::UpdateWeights(const BaseSensors& sensors) {
  const FootWeights weights =
      WeighFeet(sensors.foot_load, weight_, config_.light_load(), config_.full_load());
  grip_ = weights.standing;
  for (const Foot f : kFeet) {
    feet_[f].grip = weights.grip[f];
    feet_[f].weight = weights.share[f];
    foot_weight_[f] = grip_ * feet_[f].weight;
  }
}

void BaseEstimator::Place(const BaseSensors& sensors) {
  const Placement placement = PlaceOnGround(
      kinematics_,
      WeighFeet(sensors.foot_load, weight_, config_.light_load(), config_.full_load()));
  orientation_ = placement.orientation;
  state_.base_orientation = Quaterniond(orientation_).normalized();
  state_.base_position = placement.position;
  state_.base_linear_velocity.setZero();
  StartGyroBias(sensors);
  ReadImu(sensors);
  imu_orientation_ = Quaterniond(orientation_ * imu_rotation_).normalized();
  for (const Foot f : kFeet) {
    const Sole& sole = kinematics_.sole(f);
    feet_[f].last_offset = orientation_ * sole.position;
    feet_[f].anchor.linear() = orientation_ * sole.rotation;
    feet_[f].anchor.translation() = state_.base_position + feet_[f].last_offset;
  }
}

void BaseEstimator::StartGyroBias(const BaseSensors& sensors) {
  // Off the ground or faster than any bias it is no rest: the bias is learned later, slowly.
  if (grip_ < 1 || !(sensors.angular_velocity.cwiseAbs().maxCoeff() <= kMaxGyroBias)) return;
  gyro_bias_ = rest_gyro_ = sensors.angular_velocity;
  rest_position_ = sensors.joint_position;
  rest_load_ = sensors.foot_load;
  rest_samples_ = 1;
  rest_left_ = kRestTime;
}

void BaseEstimator::AverageGyroBias(const BaseSensors& sensors, double dt) {
  if (rest_left_ <= 0) return;
  bool at_rest =
      (sensors.joint_position - rest_position_).cwiseAbs().maxCoeff() <= kRestJointMotion &&
      sensors.angular_velocity.cwiseAbs().maxCoeff() <= kMaxGyroBias;
  for (const Foot f : kFeet) {
    at_rest =
        at_rest && std::abs(sensors.foot_load[f] - rest_load_[f]) <= kRestLoadChange * weight_;
  }
  if (!at_rest) {
    // The mean so far may hold the start of the motion: the first reading does not.
    rest_left_ = 0;
    return;
  }
  rest_gyro_ += sensors.angular_velocity;
  ++rest_samples_;
  rest_left_ -= dt;
  if (rest_left_ <= 0) gyro_bias_ = rest_gyro_ / rest_samples_;
}

void BaseEstimator::ReadImu(const BaseSensors& sensors) {
  imu_rotation_ = kinematics_.imu_rotation();
  gyro_ = Clamp(sensors.angular_velocity, kMaxRate) - gyro_bias_;
  angular_velocity_ = imu_rotation_ * gyro_ - kinematics_.imu_angular_velocity();
  imu_velocity_ = angular_velocity_.cross(kinematics_.imu_position()) + kinematics_.imu_velocity();
  imu_acceleration_ = imu_rotation_ * Clamp(sensors.acceleration, kMaxAcceleration);
}

void BaseEstimator::UpdateOrientation(const BaseSensors& sensors, double dt) {
  last_imu_velocity_ = orientation_ * imu_velocity_;
  last_acceleration_ = orientation_ * imu_acceleration_;
  // The IMU's own orientation is integrated: the joints below it then enter by their positions
  // alone. The rate of the step is the mean of the rates at its ends.
  const Vector3d last_gyro = gyro_;
  ReadImu(sensors);
  const Quaterniond predicted = imu_orientation_ * Exp(0.5 * dt * (last_gyro + gyro_));
  const Matrix3d predicted_rotation = predicted.toRotationMatrix();
  orientation_.noalias() = predicted_rotation * imu_rotation_.transpose();

  Vector3d error = Vector3d::Zero();  // of the feet, world axes
  UpdateTrust();
  for (const FootState& foot : feet_) error += grip_ * foot.weight * foot.trust * foot.turn;
  Vector3d correction = Approach(dt, config_.orientation_time_constant()) * error;
  const Vector3d up = orientation_ * imu_acceleration_;
  const double size = up.norm() / robot::kGravity;
  if (size > 0.5 && size < 1.5) {  // otherwise it is not gravity
    correction +=
        Approach(dt, config_.gravity_time_constant()) * up.cross(Vector3d::UnitZ()) / up.norm();
  }
  // A proportional-integral observer: with this gain its slow pole lies near 1 /
  // gyro_bias_time_constant.
  gyro_bias_ -= predicted_rotation.transpose() * correction / config_.gyro_bias_time_constant();
  gyro_bias_ = Clamp(gyro_bias_, kMaxGyroBias);

  imu_orientation_ = (Exp(correction) * predicted).normalized();
  orientation_.noalias() = imu_orientation_.toRotationMatrix() * imu_rotation_.transpose();
  state_.base_orientation = Quaterniond(orientation_).normalized();
}

void BaseEstimator::UpdateTrust() {
  for (const Foot f : kFeet) {
    feet_[f].turn =
        RotationError(feet_[f].anchor.linear(), orientation_ * kinematics_.sole(f).rotation);
  }
  // Gyro, right and left foot have a vote each: a foot has turned when neither of the others agrees
  // with it.
  const FootState &right = feet_[Foot::kRight], &left = feet_[Foot::kLeft];
  const bool both = right.weight > 0 && left.weight > 0;
  const double gap =
      both ? (right.turn - left.turn).squaredNorm() : std::numeric_limits<double>::infinity();
  const double tolerance = config_.foot_rotation_tolerance() * config_.foot_rotation_tolerance();
  for (FootState& foot : feet_) {
    foot.trust = tolerance / (tolerance + std::min(foot.turn.squaredNorm(), gap));
  }
}

void BaseEstimator::UpdatePosition(double dt) {
  Vector3d step = Vector3d::Zero(), foot_speed = Vector3d::Zero();
  for (const Foot f : kFeet) {
    FootState& foot = feet_[f];
    const Sole& sole = kinematics_.sole(f);
    const Vector3d offset = orientation_ * sole.position;
    step -= foot.weight * (offset - foot.last_offset);
    foot_speed +=
        foot.weight * (orientation_ * (angular_velocity_.cross(sole.position) + sole.velocity));
    foot.last_offset = offset;
  }
  // The IMU's velocity is integrated rather than the base's: that needs no angular acceleration.
  const Vector3d acceleration = 0.5 * (last_acceleration_ + orientation_ * imu_acceleration_) -
                                robot::kGravity * Vector3d::UnitZ();
  const Vector3d last_velocity = state_.base_linear_velocity;
  const Vector3d falling =
      last_velocity + last_imu_velocity_ + dt * acceleration - orientation_ * imu_velocity_;
  state_.base_linear_velocity = Clamp(-grip_ * foot_speed + (1 - grip_) * falling, kMaxSpeed);
  state_.base_position +=
      grip_ * step + (1 - grip_) * 0.5 * dt * (last_velocity + state_.base_linear_velocity);
}

void BaseEstimator::UpdateAnchors(double dt) {
  const double share = Approach(dt, config_.anchor_time_constant());
  // How far each foot stands from its anchor, and the weighted mean, which is the base's error.
  robot::FootArray<Vector3d> shift;
  Vector3d mean_shift = Vector3d::Zero();
  for (const Foot f : kFeet) {
    const FootState& foot = feet_[f];
    shift[f] = state_.base_position + foot.last_offset - foot.anchor.translation();
    mean_shift += foot.weight * shift[f];
  }
  for (const Foot f : kFeet) {
    FootState& foot = feet_[f];
    const Matrix3d rotation = orientation_ * kinematics_.sole(f).rotation;
    if (foot.grip == 0) {
      foot.anchor.linear() = rotation;
      foot.anchor.translation() += shift[f];
      continue;
    }
    const double loose = 1 - foot.grip, standing = foot.grip * share;
    // The mean shift is taken off: disagreement vanishes, while the weighted mean of the anchors
    // stays.
    foot.anchor.translation() += loose * shift[f] + standing * (shift[f] - mean_shift);
    const Vector3d turn =
        (loose + standing * (1 - foot.trust)) * RotationError(rotation, foot.anchor.linear());
    foot.anchor.linear() = Orthonormal(Exp(turn).toRotationMatrix() * foot.anchor.linear());
  }
  state_.base_position -= grip_ * share * mean_shift;
}

}  // namespace poise
