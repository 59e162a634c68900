#include "components/state_estimator/sole_kinematics.h"

#include <algorithm>

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// No foot carries more, shares of the robot's weight: keeps every finite reading finite.
constexpr double kMaxLoad = 100;
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
  for (size_t foot = 0; foot < 2; ++foot) {
    sign_[foot].assign(static_cast<size_t>(model_->num_joints()), 0);
    for (const int j : model_->supporting_joints(model_->feet()[foot].body)) {
      sign_[foot][static_cast<size_t>(j)] += 1;
    }
    for (const int j : model_->supporting_joints(model_->imu().body)) {
      sign_[foot][static_cast<size_t>(j)] -= 1;
    }
    for (int j = 0; j < model_->num_joints(); ++j) {
      if (sign_[foot][static_cast<size_t>(j)] != 0) joints_[foot].push_back(j);
    }
  }
}

void SoleKinematics::Update(const Eigen::Ref<const Eigen::VectorXd>& position,
                            const Eigen::Ref<const Eigen::VectorXd>& velocity) {
  state_.joint_position = position;
  state_.joint_velocity = velocity;
  robot::ComputeKinematics(*model_, state_, &data_);
  for (size_t i = 0; i < soles_.size(); ++i) {
    const robot::FootModel& model = model_->feet()[i];
    const size_t b = static_cast<size_t>(model.body);
    const Vector3d arm = data_.body_rotation[b] * model.sole.translation();
    soles_[i].position = data_.body_position[b] + arm;
    soles_[i].rotation.noalias() = data_.body_rotation[b] * model.sole.linear();
    soles_[i].velocity = data_.body_linear_velocity[b] + data_.body_angular_velocity[b].cross(arm);
  }
  const robot::ImuModel& imu = model_->imu();
  const size_t b = static_cast<size_t>(imu.body);
  const Vector3d arm = data_.body_rotation[b] * imu.pose.translation();
  imu_rotation_.noalias() = data_.body_rotation[b] * imu.pose.linear();
  imu_position_ = data_.body_position[b] + arm;
  imu_angular_velocity_ = data_.body_angular_velocity[b];
  imu_velocity_ = data_.body_linear_velocity[b] + imu_angular_velocity_.cross(arm);
}

FootWeights WeighFeet(const std::array<double, 2>& load, double robot_weight, double light_load,
                      double full_load) {
  FootWeights weights;
  std::array<double, 2> pull;
  double sum = 0, grip = 0;
  for (size_t i = 0; i < load.size(); ++i) {
    const double share = std::clamp(load[i] / robot_weight, 0.0, kMaxLoad);
    weights.grip[i] = CubicStep((share - light_load) / (full_load - light_load));
    pull[i] = weights.grip[i] * share;
    sum += pull[i];
    grip += weights.grip[i];
  }
  weights.standing = sum > 0 ? std::min(grip, 1.0) : 0.0;
  for (size_t i = 0; i < load.size(); ++i) weights.share[i] = sum > 0 ? pull[i] / sum : 0.0;
  return weights;
}

Placement PlaceOnGround(const SoleKinematics& kinematics, const FootWeights& weights) {
  const Sole& right = kinematics.sole(Index(robot::Foot::kRight));
  const Sole& left = kinematics.sole(Index(robot::Foot::kLeft));
  std::array<double, 2> weight = weights.share;
  const auto normal = [&] {
    return Vector3d(weight[0] * right.rotation.col(2) + weight[1] * left.rotation.col(2))
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
  placement.position.z() = -(weight[0] * right_offset.z() + weight[1] * left_offset.z());
  return placement;
}

Matrix3d Orthonormal(const Matrix3d& m) {
  return m * (1.5 * Matrix3d::Identity() - 0.5 * m.transpose() * m);
}

}  // namespace poise
