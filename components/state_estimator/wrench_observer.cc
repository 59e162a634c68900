#include "components/state_estimator/wrench_observer.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "components/state_estimator/lie_group.h"
#include "components/state_estimator/square.h"

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using robot::Foot;
using robot::kFeet;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix6x12 = Eigen::Matrix<double, 6, 12>;

// No robot exceeds these: they keep every finite reading from making a number that is not.
constexpr double kMaxPosition = 1e3, kMaxRate = 100, kMaxForce = 1e3, kMaxJointTorque = 1e4;
constexpr double kLongestStep = 0.1;  // s: after a longer gap the filter starts anew
// What is known before any row: no foot carries more, shares of the weight, and of the weight at a
// metre.
constexpr double kPriorForce = 2, kPriorMoment = 0.3;
// (N·m)², of a joint's row at least, beside what encoder steps leave of the rotor's acceleration.
constexpr double kLeastVariance = 0.01;
// s, over which what a free foot seems to carry is compared with its deviation; while it may be
// pressed; and for which that holds when it is no longer free.
constexpr double kFitTime = 0.3, kPressedFitTime = 5, kFitHold = 1;
constexpr double kLeastFit = 0.1;  // a third of the deviation
// s, over which the wrenches' rate of change is averaged.
constexpr double kRateTime = 0.02;
// Shares by which joint friction differs from the robot file's, a joint's torque from its current's
// (a torque constant's tolerance), and the mass from the model's (cables and covers): standard
// deviations.
constexpr double kFrictionError = 0.5, kTorqueError = 0.02, kMassError = 0.02;
// N·m/rad of a joint that sticks, a harmonic drive's: it holds the friction it slipped with until
// it is bent back.
constexpr double kFrictionStiffness = 1e4;
constexpr double kComError = 0.006;  // m by which the COM is not known, standard deviation
// m/s² by which the base's acceleration is not known once the IMU's bias is: what is left of the
// bias, and flexing.
constexpr double kAccelerationError = 0.03;
// Squared normalised disagreement of base and legs (chi-squared, 6 degrees of freedom) beyond which
// something pushes the robot, and the base's rows lose weight.
constexpr double kPushGate = 25;
// s by which the wrenches lag behind the readings, half of the low-pass's delay: times their rate
// of change it is part of the covariance.
constexpr double kLatency = 0.005;

}  // namespace

WrenchObserver::WrenchObserver(std::shared_ptr<const robot::RobotModel> model, double cutoff)
    : model_(std::move(model)),
      filter_(2 * model_->num_joints() + 6, cutoff),
      input_(Eigen::VectorXd::Zero(2 * model_->num_joints() + 6)),
      state_(model_->num_joints()),
      data_(*model_),
      linear_(model_->bodies().size(), Vector3d::Zero()),
      angular_(linear_),
      force_(linear_),
      moment_(linear_),
      joint_torque_(Eigen::VectorXd::Zero(model_->num_joints())),
      errors_(0, {}) {
  for (int j = 0; j < model_->num_joints(); ++j) {
    robot::FootArray<bool> supports{};
    for (const Foot f : kFeet) {
      for (const int other : model_->supporting_joints(model_->feet()[f].body)) {
        supports[f] = supports[f] || other == j;
      }
    }
    if (Count(supports) == 0) continue;
    leg_joints_.push_back(j);
    supports_.push_back(supports);
  }
  errors_ = JointErrors(leg_joints_.size(), {kFrictionError, kTorqueError, kMassError});
  torques_.assign(leg_joints_.size(), {});
  residual_ = variance_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(leg_joints_.size()));
  noise_ = bristle_ = bristle_error_ =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(leg_joints_.size()));
  for (size_t k = 0; k < leg_joints_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const robot::MotorModel& motor = model_->motors()[static_cast<size_t>(leg_joints_[k])];
    bristle_error_[i] = motor.static_friction / std::sqrt(3.0);
    // White noise passes to the low-pass's second derivative with ω², times 0.8 to 1.
    const double count = 2 * std::numbers::pi / (motor.gear_ratio * motor.encoder_counts);
    const double acceleration = Square(2 * std::numbers::pi * cutoff) * count / std::sqrt(12.0);
    noise_[i] = kLeastVariance;
    if (std::isfinite(acceleration)) noise_[i] += Square(motor.reflected_inertia * acceleration);
  }
  sole_position_.fill(Vector3d::Zero());
  sole_rotation_.fill(Matrix3d::Identity());
}

void WrenchObserver::Track(const BaseSensors& sensors, double dt) {
  const Eigen::Index n = model_->num_joints();
  const auto within = [](const auto& v, double limit) {
    return v.cwiseMin(limit).cwiseMax(-limit);
  };
  input_.head(n) = within(sensors.joint_position, kMaxPosition);
  input_.segment<3>(n) = within(sensors.angular_velocity, kMaxRate);
  input_.segment<3>(n + 3) = within(sensors.acceleration, kMaxForce);
  torque_known_ = sensors.joint_torque.size() == n && !sensors.joint_torque.isZero(0);
  if (torque_known_) {
    input_.tail(n) = within(sensors.joint_torque, kMaxJointTorque);
  } else {
    input_.tail(n).setZero();
  }
  since_ += dt;
  if (started_ && dt <= kLongestStep) {
    filter_.Step(input_, dt);
    TrackFriction(dt);
  } else {
    filter_.Reset(input_);
    observed_ = false;
  }
  started_ = true;
}

// Dahl's model: dF = σ (1 − F sgn(dq) / F_c) dq, exactly over a step of one direction.
void WrenchObserver::TrackFriction(double dt) {
  const Eigen::Index n = model_->num_joints();
  for (size_t k = 0; k < leg_joints_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double limit = model_->motors()[static_cast<size_t>(leg_joints_[k])].coulomb_friction;
    if (!(limit > 0)) continue;
    const double way = dt * filter_.rate().head(n)[leg_joints_[k]];
    const double end = std::copysign(limit, way);
    const double keep = std::exp(-kFrictionStiffness * std::abs(way) / limit);
    bristle_[i] = end + keep * (bristle_[i] - end);
    const double error = kFrictionError * limit;
    bristle_error_[i] = error + keep * (bristle_error_[i] - error);
  }
}

// Base and joints from the readings, whatever body carries the IMU. The IMU's angular acceleration
// is its gyro's rate of change, in its own axes and in those of an observer at rest.
void WrenchObserver::ReadMotion(const ObserverCorrection& correction) {
  const Eigen::Index n = model_->num_joints();
  state_.joint_position = filter_.value().head(n);
  state_.joint_velocity = filter_.rate().head(n);
  const robot::ImuModel& imu = model_->imu();
  const auto b = static_cast<size_t>(imu.body);
  const Vector3d gyro = filter_.value().segment<3>(n) - correction.gyro_bias;
  Matrix3d to_base = imu.pose.linear();
  if (b != 0) {
    // Joints lie between the IMU and the base: their axes are computed first.
    state_.base_angular_velocity.setZero();
    robot::ComputeKinematics(*model_, state_, &data_);
    to_base = data_.body_rotation[b] * imu.pose.linear();
    state_.base_angular_velocity = to_base * gyro - data_.body_angular_velocity[b];
  } else {
    state_.base_angular_velocity = to_base * gyro;
  }
  robot::ComputeKinematics(*model_, state_, &data_);

  const Vector3d arm = data_.body_rotation[b] * imu.pose.translation();
  const Vector3d point = data_.body_position[b] + arm;
  const Vector3d& w = data_.body_angular_velocity[b];
  Vector3d turn = to_base * filter_.rate().segment<3>(n) - data_.body_angular_bias[b];
  Vector3d push =
      to_base * (filter_.value().segment<3>(n + 3) - correction.accelerometer_bias) -
      (data_.body_linear_bias[b] + data_.body_angular_bias[b].cross(arm) + w.cross(w.cross(arm)));
  for (const int joint : model_->supporting_joints(imu.body)) {
    const auto j = static_cast<size_t>(joint);
    const Vector3d spin = data_.joint_axis[j] * filter_.curvature()[joint];
    turn -= spin;
    push -= spin.cross(point - data_.body_position[j + 1]);
  }
  base_acceleration_ = turn;
  base_force_ = push - turn.cross(point);
}

// The load moves with the base; its inertia is not known and left out.
void WrenchObserver::AddLoad(const ObserverCorrection& correction) {
  const Vector3d& h = correction.load_moment;
  const Vector3d& w = data_.body_angular_velocity[0];
  force_[0] +=
      correction.load_mass * base_force_ + base_acceleration_.cross(h) + w.cross(w.cross(h));
  moment_[0] += h.cross(base_force_);
  mass_ += correction.load_mass;
  com_ += h;
}

// Newton and Euler of the filtered motion, gravity being part of the base's acceleration.
void WrenchObserver::InverseDynamics() {
  const robot::KinematicTree& tree = model_->tree();
  linear_[0] = base_force_;
  angular_[0] = base_acceleration_;
  for (size_t b = 1; b < tree.bodies.size(); ++b) {
    const auto p = static_cast<size_t>(tree.bodies[b].parent);
    angular_[b] = angular_[p] +
                  data_.joint_axis[b - 1] * filter_.curvature()[static_cast<Eigen::Index>(b) - 1];
    linear_[b] = linear_[p] + angular_[p].cross(data_.body_position[b] - data_.body_position[p]);
  }
  for (size_t b = 0; b < tree.bodies.size(); ++b) {
    const robot::KinematicTree::BodyMass& body = tree.bodies[b];
    const Matrix3d& rotation = data_.body_rotation[b];
    const Vector3d arm = rotation * body.com;
    const Vector3d com = data_.body_position[b] + arm;
    const Vector3d& w = data_.body_angular_velocity[b];
    const Vector3d alpha = angular_[b] + data_.body_angular_bias[b];
    const Vector3d linear = linear_[b] + data_.body_linear_bias[b];
    const Vector3d turned = rotation.transpose() * w;
    force_[b] = body.mass * (linear + alpha.cross(arm) + w.cross(w.cross(arm)));
    moment_[b] = com.cross(force_[b]) + rotation * (body.inertia * (rotation.transpose() * alpha) +
                                                    turned.cross(body.inertia * turned));
    com_ += body.mass * com;
  }
}

void WrenchObserver::AddJointRows() {
  const robot::KinematicTree& tree = model_->tree();
  for (size_t b = tree.bodies.size() - 1; b > 0; --b) {
    const auto j = static_cast<Eigen::Index>(b) - 1;
    joint_torque_[j] =
        data_.joint_axis[b - 1].dot(moment_[b] - data_.body_position[b].cross(force_[b])) +
        tree.joints[b - 1].reflected_inertia * filter_.curvature()[j];
    const auto p = static_cast<size_t>(tree.bodies[b].parent);
    force_[p] += force_[b];
    moment_[p] += moment_[b];
  }

  const double weight = model_->total_mass() * robot::kGravity;
  Covariance information = Covariance::Zero();
  for (int i = 0; i < 12; ++i) {
    information(i, i) = 1 / Square((i % 6 < 3 ? kPriorForce : kPriorMoment) * weight);
  }
  Wrenches sum = Wrenches::Zero();
  for (size_t k = 0; torque_known_ && k < leg_joints_.size(); ++k) {
    const Eigen::Index joint = leg_joints_[k];
    const auto j = static_cast<size_t>(joint);
    const robot::MotorModel& motor = model_->motors()[j];
    const double speed = state_.joint_velocity[joint],
                 torque = filter_.value()[6 + state_.joint_position.size() + joint];
    const double held = bristle_[static_cast<Eigen::Index>(k)];
    const double friction = held + motor.viscous_friction * speed;
    double variance = Square(bristle_error_[static_cast<Eigen::Index>(k)]) +
                      Square(kFrictionError * motor.viscous_friction * speed) +
                      Square(kTorqueError * torque) + Square(kMassError * joint_torque_[joint]) +
                      noise_[static_cast<Eigen::Index>(k)];
    double known = torque - friction - joint_torque_[joint];
    torques_[k] = {held, torque, joint_torque_[joint]};
    residual_[static_cast<Eigen::Index>(k)] = known;
    variance_[static_cast<Eigen::Index>(k)] = variance;
    const JointErrors::Corrected corrected = errors_.Correct(k, torques_[k], variance);
    known -= corrected.error;
    variance = std::max(corrected.variance, noise_[static_cast<Eigen::Index>(k)]);
    robot::FootArray<robot::Vector6d> row;
    for (const Foot f : kFeet) {
      if (!supports_[k][f]) continue;
      const Vector3d& axis = data_.joint_axis[j];
      row[f] << sole_rotation_[f].transpose() *
                    axis.cross(sole_position_[f] - data_.body_position[j + 1]),
          sole_rotation_[f].transpose() * axis;
      const robot::Vector6d weighted = row[f] / variance;
      const auto at = 6 * static_cast<Eigen::Index>(f);
      information.block<6, 6>(at, at).noalias() += weighted * row[f].transpose();
      sum.segment<6>(at) += known * weighted;
    }
    if (Count(supports_[k]) == 2) {
      information.block<6, 6>(6, 0).noalias() +=
          row[Foot::kLeft] * row[Foot::kRight].transpose() / variance;
    }
  }
  information.block<6, 6>(0, 6) = information.block<6, 6>(6, 0).transpose();
  const Eigen::LLT<Covariance> factors(information);
  spread_ = factors.solve(Covariance::Identity());
  estimate_ = spread_ * sum;
}

bool WrenchObserver::AddBaseRows() {
  const double mass = std::max(mass_, 0.1 * model_->total_mass());
  const Vector3d com = com_ / mass;
  Matrix6x12 sum;  // of both feet, about the COM
  for (const Foot f : kFeet) {
    const auto at = 6 * static_cast<Eigen::Index>(f);
    const Matrix3d& r = sole_rotation_[f];
    sum.block<3, 3>(0, at) = r;
    sum.block<3, 3>(0, at + 3).setZero();
    sum.block<3, 3>(3, at) = Skew(sole_position_[f] - com) * r;
    sum.block<3, 3>(3, at + 3) = r;
  }
  robot::Vector6d base;
  base << -force_[0], -moment_[0] + com.cross(force_[0]);
  const double size = base_force_.norm();
  robot::Vector6d noise;
  for (int i = 0; i < 3; ++i) {
    noise[i] = Square(mass * kMassError * base_force_[i]) + Square(mass * kAccelerationError);
    noise[3 + i] = Square(mass * kComError * size);
  }
  const robot::Vector6d gap = base - sum * estimate_;
  const Eigen::Matrix<double, 12, 6> cross = spread_ * sum.transpose();
  Matrix6 innovation = sum * cross;
  Matrix6 total = innovation;
  total.diagonal() += noise;
  Eigen::LLT<Matrix6> factors(total);
  push_excess_ = torque_known_ ? gap.dot(factors.solve(gap)) : 0;
  if (!std::isfinite(push_excess_)) return false;
  if (pushed()) {
    // Something else pushes: what the base says is worth less, the more they disagree.
    total.diagonal() += (Square(push_excess_ / kPushGate) - 1) * noise;
    factors.compute(total);
  }
  const Eigen::Matrix<double, 6, 12> gain = factors.solve(cross.transpose());
  estimate_ += gain.transpose() * gap;
  spread_ -= cross * gain;
  return estimate_.allFinite();
}

bool WrenchObserver::pushed() const { return push_excess_ > kPushGate; }

// What a leg that swings seems to carry is its joints' error.
void WrenchObserver::Learn(double dt) {
  const Vector3d between = sole_rotation_[Foot::kRight].transpose() *
                           (sole_position_[Foot::kLeft] - sole_position_[Foot::kRight]);
  const double speed = observed_ ? (between - between_).norm() / dt : 0;
  between_ = between;
  for (const Foot f : kFeet) {
    const auto at = 6 * static_cast<Eigen::Index>(f);
    const robot::Vector6d wrench = estimate_.segment<6>(at);
    const Matrix6 spread = spread_.block<6, 6>(at, at);
    const double excess = wrench.dot(spread.llt().solve(wrench));
    const double load = -wrench[2] / std::sqrt(std::max(spread(2, 2), kLeastVariance));
    const double press = load / std::sqrt(fit_[f]);
    const bool begins = free_foot_[f].Update(speed, excess, press, dt);
    const bool pressed = press > 1;
    if (!free_foot_[f].free() || begins) {
      fit_[f] += begins ? 1 - fit_[f] : std::min(dt / kFitHold, 1.0) * (1 - fit_[f]);
      if (!begins) continue;
    }
    const double size = std::clamp(Square(load), kLeastFit, 1.0);
    fit_[f] += std::min(dt / (pressed ? kPressedFitTime : kFitTime), 1.0) * (size - fit_[f]);
    for (size_t k = 0; k < leg_joints_.size(); ++k) {
      if (!supports_[k][f] || supports_[k][Other(f)]) continue;
      if (begins) errors_.Begin(k);
      errors_.Learn(k, torques_[k], residual_[static_cast<Eigen::Index>(k)],
                    variance_[static_cast<Eigen::Index>(k)], pressed, dt);
    }
  }
}

bool WrenchObserver::Observe(const ObserverCorrection& correction, bool learn) {
  mass_ = model_->total_mass();
  com_.setZero();
  ReadMotion(correction);
  for (const Foot f : kFeet) {
    const robot::FootModel& foot = model_->feet()[f];
    const auto b = static_cast<size_t>(foot.body);
    sole_position_[f] = data_.body_position[b] + data_.body_rotation[b] * foot.sole.translation();
    sole_rotation_[f] = data_.body_rotation[b] * foot.sole.linear();
  }
  InverseDynamics();
  AddJointRows();
  base_wrench_ << force_[0], moment_[0];
  // What the base carries, it carries alone: no joint's row knows of it.
  AddLoad(correction);
  if (!AddBaseRows()) return false;
  if (since_ > 0) errors_.Age(since_);
  if (learn && torque_known_ && since_ > 0) {
    Learn(since_);
  } else {
    for (double& fit : fit_) fit += std::min(since_ / kFitHold, 1.0) * (1 - fit);
  }
  if (observed_ && since_ > 0) {
    const double share = std::min(since_ / kRateTime, 1.0);
    rate_ += share * ((estimate_ - wrenches_) / since_ - rate_);
  } else {
    rate_.setZero();
  }
  since_ = 0;
  observed_ = true;
  wrenches_ = estimate_;
  covariance_ = settled_covariance_ = spread_;
  for (const Foot f : kFeet) {
    const auto at = 6 * static_cast<Eigen::Index>(f);
    settled_covariance_.block<6, 6>(at, at) *= fit_[f];
  }
  const Wrenches late = kLatency * rate_;
  covariance_.noalias() += late * late.transpose();
  return true;
}

void WrenchObserver::Archive(StateArchive* archive) {
  filter_.Archive(archive);
  archive->Show(input_, bristle_, bristle_error_, wrenches_, rate_, push_excess_, since_,
                torque_known_, started_, observed_);
  archive->Show(covariance_, settled_covariance_, between_, fit_);
  errors_.Archive(archive);
  for (FreeFoot& foot : free_foot_) foot.Archive(archive);
}

}  // namespace poise
