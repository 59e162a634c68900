#include "tests/components/base_motion.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "components/robot/posture.h"
#include "components/robot_files/robot_files.h"

namespace poise {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kTurn = 2 * std::numbers::pi;

Vector3d RotationVector(const Matrix3d& rotation) {
  const Eigen::AngleAxisd difference(rotation);
  return difference.angle() * difference.axis();
}

// Standing with bent knees, as high as the robot stands with these joint angles.
robot::RobotState Stand(const robot::RobotModel& model) {
  robot::RobotState bent(model.num_joints());
  for (int j = 0; j < model.num_joints(); ++j) {
    const std::string& name = model.joints()[static_cast<size_t>(j)].name;
    const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
    if (has("hip_pitch") || has("ankle_pitch")) bent.joint_position[j] = -0.4;
    if (has("knee")) bent.joint_position[j] = 0.8;
  }
  const robot::RobotData data = robot::Evaluate(model, bent);
  const Vector3d right = data.foot_pose[0].translation(), left = data.foot_pose[1].translation();
  robot::PostureGoal goal;
  const double spacing = left.y() - right.y();
  goal.foot[0] = goal.foot[1] = Isometry3d::Identity();
  goal.foot[0].translation().y() = -spacing / 2;
  goal.foot[1].translation().y() = spacing / 2;
  goal.com_height = data.com.z() - 0.5 * (right.z() + left.z());
  goal.nominal = bent.joint_position;
  return robot::SolvePosture(model, goal);
}

}  // namespace

SensorErrors TypicalErrors(const robot::RobotModel& model) {
  const robot::ImuModel& imu = model.imu();
  SensorErrors errors;
  errors.gyro_noise = imu.gyro_noise;
  errors.gyro_bias = imu.gyro_bias * Vector3d(1, -1, 1);
  errors.accelerometer_noise = imu.accelerometer_noise;
  errors.accelerometer_bias = imu.accelerometer_bias * Vector3d(1, -1, 1) / std::sqrt(3.0);
  errors.load_noise = model.force_noise();
  errors.encoder_steps = true;
  return errors;
}

BaseMotion::BaseMotion(const std::string& path)
    : model_(std::make_shared<const robot::RobotModel>(robot::LoadRobotFiles(path))),
      data_(*model_),
      start_(Stand(*model_)),
      now_(start_),
      reading_(VectorXd::Zero(model_->num_joints())) {
  script_.base_position = [p = start_.base_position](double) { return p; };
  script_.base_orientation = [q = start_.base_orientation](double) { return q; };
  robot::ComputeKinematics(*model_, start_, &data_);
  robot::ComputeFeet(*model_, &data_);
  for (size_t f = 0; f < 2; ++f) {
    script_.foot[f] = [pose = data_.foot_pose[f]](double) { return pose; };
    script_.load[f] = [](double) { return 0.5; };
    const auto joints = model_->supporting_joints(model_->feet()[f].body);
    leg_[f].assign(joints.begin(), joints.end());
  }
}

// Newton's method for the six joints of each leg.
BaseMotion::Sample BaseMotion::Solve(double time, const VectorXd& guess) {
  Sample sample;
  sample.state = robot::RobotState(model_->num_joints());
  sample.state.base_position = script_.base_position(time);
  sample.state.base_orientation = script_.base_orientation(time).normalized();
  VectorXd& q = sample.state.joint_position;
  q = start_.joint_position.array() + script_.other_joints(time);
  for (const auto& leg : leg_) {
    for (const int j : leg) q[j] = guess[j];
  }
  double error = 1;
  for (int iteration = 0; iteration < 50 && error > 1e-14; ++iteration) {
    robot::ComputeKinematics(*model_, sample.state, &data_);
    robot::ComputeFeet(*model_, &data_);
    error = 0;
    for (size_t f = 0; f < 2; ++f) {
      const Isometry3d goal = script_.foot[f](time);
      robot::Vector6d miss;
      miss << goal.translation() - data_.foot_pose[f].translation(),
          RotationVector(goal.linear() * data_.foot_pose[f].linear().transpose());
      Eigen::Matrix<double, 6, 6> jacobian;
      for (int k = 0; k < 6; ++k) {
        jacobian.col(k) = data_.foot_jacobian[f].col(6 + leg_[f][static_cast<size_t>(k)]);
      }
      const robot::Vector6d step = jacobian.partialPivLu().solve(miss);
      for (int k = 0; k < 6; ++k) q[leg_[f][static_cast<size_t>(k)]] += step[k];
      error = std::max(error, miss.cwiseAbs().maxCoeff());
    }
  }
  if (error > 1e-11) throw std::logic_error("the script asks for a pose out of reach");
  robot::ComputeKinematics(*model_, sample.state, &data_);
  const robot::ImuModel& imu = model_->imu();
  const size_t b = static_cast<size_t>(imu.body);
  sample.imu_rotation = data_.body_rotation[b] * imu.pose.linear();
  sample.imu_position = sample.state.base_position + data_.body_position[b] +
                        data_.body_rotation[b] * imu.pose.translation();
  return sample;
}

void BaseMotion::Next() {
  ++sample_;
  if (sample_ == 0) {
    before_ = Solve(-kGrid, start_.joint_position);
  } else {
    before_ = after_;
  }
  at_ = Solve(time(), before_.state.joint_position);
  after_ = Solve(time() + kGrid, at_.state.joint_position);

  // Central differences over one grid step: errors of kGrid² / 6 times the third derivative.
  now_ = at_.state;
  const double two_steps = 2 * kGrid;
  now_.base_linear_velocity =
      (after_.state.base_position - before_.state.base_position) / two_steps;
  now_.base_angular_velocity =
      RotationVector((after_.state.base_orientation * before_.state.base_orientation.conjugate())
                         .toRotationMatrix()) /
      two_steps;
  now_.joint_velocity = (after_.state.joint_position - before_.state.joint_position) / two_steps;
}

Vector3d BaseMotion::com() const {
  robot::RobotData data(*model_);
  robot::ComputeKinematics(*model_, now_, &data);
  robot::ComputeDynamics(*model_, now_, &data);
  return data.com;
}

BaseSensors BaseMotion::sensors() {
  std::normal_distribution<double> normal;
  const auto noise = [&] { return Vector3d(normal(random_), normal(random_), normal(random_)); };

  reading_ = now_.joint_position;
  if (errors_.encoder_steps) {
    for (int j = 0; j < model_->num_joints(); ++j) {
      const robot::MotorModel& motor = model_->motors()[static_cast<size_t>(j)];
      const double step = 2 * std::numbers::pi / (motor.gear_ratio * motor.encoder_counts);
      reading_[j] = std::round(reading_[j] / step) * step;
    }
  }
  const Vector3d rate =
      RotationVector(after_.imu_rotation * before_.imu_rotation.transpose()) / (2 * kGrid);
  const Vector3d acceleration =
      (after_.imu_position - 2 * at_.imu_position + before_.imu_position) / (kGrid * kGrid);
  const Vector3d specific_force = acceleration + robot::kGravity * Vector3d::UnitZ();
  const Vector3d gyro =
      at_.imu_rotation.transpose() * rate + errors_.gyro_bias + errors_.gyro_noise * noise();
  const Vector3d accelerometer = at_.imu_rotation.transpose() * specific_force +
                                 errors_.accelerometer_bias + errors_.accelerometer_noise * noise();
  std::array<double, 2> load;
  for (size_t f = 0; f < 2; ++f) {
    load[f] = script_.load[f](time()) * model_->total_mass() * robot::kGravity +
              errors_.load_noise * normal(random_);
  }
  return {{reading_.data(), reading_.size()}, gyro, accelerometer, load};
}

double Ramp(double t, double start, double end) {
  const double s = std::clamp((t - start) / (end - start), 0.0, 1.0);
  return s * s * s * (10 - 15 * s + 6 * s * s);
}

void Sway(BaseMotion* motion, double amplitude) {
  const Vector3d p = motion->start().base_position;
  const Quaterniond q = motion->start().base_orientation;
  motion->script().base_position = [=](double t) -> Vector3d {
    const double a = amplitude * Ramp(t, 0, 1);
    return p + a * Vector3d(std::sin(kTurn * 0.4 * t), std::cos(kTurn * 0.3 * t),
                            -0.5 - 0.5 * std::cos(kTurn * 0.5 * t));
  };
  motion->script().base_orientation = [=](double t) {
    const double a = 3 * amplitude * Ramp(t, 0, 1);
    return q * AngleAxisd(a * std::sin(kTurn * 0.35 * t), Vector3d::UnitX()) *
           AngleAxisd(a * std::cos(kTurn * 0.45 * t), Vector3d(0, 0.8, 0.6));
  };
  motion->script().other_joints = [=](double t) {
    return 5 * amplitude * Ramp(t, 0, 1) * std::sin(kTurn * 0.4 * t);
  };
}

void StepUp(BaseMotion* motion) {
  const Vector3d p = motion->start().base_position;
  MotionScript& script = motion->script();
  script.base_position = [=](double t) -> Vector3d {
    return p + Vector3d(0.05 * Ramp(t, 3, 4.5), -0.08 * Ramp(t, 0, 1) + 0.10 * Ramp(t, 3, 4.5), 0);
  };
  const Isometry3d start = script.foot[1](0);
  script.foot[1] = [=](double t) {
    Eigen::Isometry3d foot = start;
    foot.translation().x() += 0.10 * Ramp(t, 1.7, 2.3);
    foot.translation().z() += 0.10 * Ramp(t, 1.5, 2) - 0.05 * Ramp(t, 2.1, 2.6);
    return foot;
  };
  script.load[1] = [=](double t) {
    return 0.5 * (1 - Ramp(t, 0.2, 1.2)) + 0.8 * Ramp(t, 2.7, 3.5);
  };
  script.load[0] = [load = script.load[1]](double t) { return 1 - load(t); };
}

double TiltError(const Quaterniond& estimate, const Quaterniond& truth) {
  const Vector3d a = estimate.conjugate() * Vector3d::UnitZ(),
                 b = truth.conjugate() * Vector3d::UnitZ();
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

double AnyFinite(std::mt19937_64* random) {
  switch ((*random)() % 6) {
    case 0:
      return std::numeric_limits<double>::max();
    case 1:
      return -std::numeric_limits<double>::max();
    case 2:
      return std::numeric_limits<double>::denorm_min();
    case 3:
      return 0;
    default:
      return std::uniform_real_distribution<double>(-10, 10)(*random);
  }
}

}  // namespace poise
