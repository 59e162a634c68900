#include "components/state_estimator/sole_kinematics.h"

#include <algorithm>

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using robot::Foot;
using robot::kFeet;

// No foot carries more, shares of the robot's weight: keeps every finite reading finite.
constexpr double kMaxLoad = 100;
// Shares of the weight, measured, below which a foot no longer stands and from which on it does.
constexpr double kLightLoad = 0.05, kFullLoad = 0.2;
// Feet without load at first: beyond this difference of height, m, only the lower one stands.
constexpr double kLevel = 0.01;

/// 3 s² − 2 s³: of a weight, not of a motion, so that its slope alone has to vanish at the ends.
double CubicStep(double x) {
  const double s = std::clamp(x, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

}  // namespace

SoleKinematics::SoleKinematics(std::shared_ptr<const robot::RobotModel> model)
    : model_(std::move(model)), state_(model_->num_joints()), data_(*model_) {
  for (const Foot f : kFeet) {
    sign_[f].assign(static_cast<size_t>(model_->num_joints()), 0);
    for (const int j : model_->supporting_joints(model_->feet()[f].body)) {
      sign_[f][static_cast<size_t>(j)] += 1;
    }
    for (const int j : model_->supporting_joints(model_->imu().body)) {
      sign_[f][static_cast<size_t>(j)] -= 1;
    }
    for (int j = 0; j < model_->num_joints(); ++j) {
      if (sign_[f][static_cast<size_t>(j)] != 0) joints_[f].push_back(j);
    }
  }
}

void SoleKinematics::Update(const Eigen::Ref<const Eigen::VectorXd>& position,
                            const Eigen::Ref<const Eigen::VectorXd>& velocity) {
  state_.joint_position = position;
  state_.joint_velocity = velocity;
  robot::ComputeKinematics(*model_, state_, &data_);
  for (const Foot f : kFeet) {
    const robot::FootModel& model = model_->feet()[f];
    const size_t b = static_cast<size_t>(model.body);
    const Vector3d arm = data_.body_rotation[b] * model.sole.translation();
    soles_[f].position = data_.body_position[b] + arm;
    soles_[f].rotation.noalias() = data_.body_rotation[b] * model.sole.linear();
    soles_[f].velocity = data_.body_linear_velocity[b] + data_.body_angular_velocity[b].cross(arm);
  }
  const robot::ImuModel& imu = model_->imu();
  const size_t b = static_cast<size_t>(imu.body);
  const Vector3d arm = data_.body_rotation[b] * imu.pose.translation();
  imu_rotation_.noalias() = data_.body_rotation[b] * imu.pose.linear();
  imu_position_ = data_.body_position[b] + arm;
  imu_angular_velocity_ = data_.body_angular_velocity[b];
  imu_velocity_ = data_.body_linear_velocity[b] + imu_angular_velocity_.cross(arm);
}

FootWeights WeighFeet(const robot::FootArray<double>& load, double robot_weight) {
  FootWeights weights;
  robot::FootArray<double> pull;
  double sum = 0, grip = 0;
  for (const Foot f : kFeet) {
    const double share = std::clamp(load[f] / robot_weight, 0.0, kMaxLoad);
    weights.grip[f] = CubicStep((share - kLightLoad) / (kFullLoad - kLightLoad));
    pull[f] = weights.grip[f] * share;
    sum += pull[f];
    grip += weights.grip[f];
  }
  weights.standing = sum > 0 ? std::min(grip, 1.0) : 0.0;
  for (const Foot f : kFeet) weights.share[f] = sum > 0 ? pull[f] / sum : 0.0;
  return weights;
}

Placement PlaceOnGround(const SoleKinematics& kinematics, const FootWeights& weights) {
  const Sole& right = kinematics.sole(Foot::kRight);
  const Sole& left = kinematics.sole(Foot::kLeft);
  robot::FootArray<double> weight = weights.share;
  const auto normal = [&] {
    return Vector3d(weight[Foot::kRight] * right.rotation.col(2) +
                    weight[Foot::kLeft] * left.rotation.col(2))
        .normalized();
  };
  if (weights.standing == 0) {
    weight = {0.5, 0.5};
    const double right_above_left = normal().dot(right.position - left.position);
    if (right_above_left > kLevel) weight = {0, 1};
    if (right_above_left < -kLevel) weight = {1, 0};
  }
  const Vector3d up = normal();
  Vector3d y = left.position - right.position;
  y -= up.dot(y) * up;
  if (y.norm() < 1e-6) y = up.cross(Vector3d::UnitX());  // soles over each other
  if (y.norm() < 1e-6) y = Vector3d::UnitY();
  y.normalize();
  Placement placement;
  placement.orientation.row(0) = y.cross(up);
  placement.orientation.row(1) = y;
  placement.orientation.row(2) = up;
  if (!placement.orientation.allFinite())
    placement.orientation.setIdentity();  // soles face to face
  placement.orientation = Orthonormal(placement.orientation);

  const Vector3d right_offset = placement.orientation * right.position;
  const Vector3d left_offset = placement.orientation * left.position;
  placement.position = -0.5 * (right_offset + left_offset);
  placement.position.z() =
      -(weight[Foot::kRight] * right_offset.z() + weight[Foot::kLeft] * left_offset.z());
  return placement;
}

Matrix3d Orthonormal(const Matrix3d& m) {
  return m * (1.5 * Matrix3d::Identity() - 0.5 * m.transpose() * m);
}

}  // namespace poise
