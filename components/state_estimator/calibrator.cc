#include "components/state_estimator/calibrator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "components/state_estimator/lie_group.h"
#include "components/state_estimator/square.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using robot::Foot;
using robot::kFeet;

// Standard deviations at first: of the mass a share of the robot's, of its place m. A load of 15 %
// anywhere, a COM off by 3 cm.
constexpr double kStartMass = 0.15, kStartShift = 0.05;
// The largest load that is believed: share of the robot's mass, and m times that mass of its moment
// along each axis.
constexpr double kMaxMass = 0.2, kMaxShift = 0.1;
// Share of the robot's mass per √s, and m times it of the moment: how fast a load may change.
constexpr double kWalk = 0.002;
// N and N·m, per reading, of both feet's wrench less what the motion asks for.
constexpr double kForceError = 2, kMomentError = 0.3;
// rad/s of the body, and m/s² between its specific force and gravity, above which nothing is
// learnt.
constexpr double kStillRate = 0.3, kStillAcceleration = 0.5;
// Squared normalised disagreement (chi-squared, 6 degrees of freedom) of a reading that is left
// out.
constexpr double kOutlierGate = 40;
constexpr double kApplyTime = 0.2;  // s, time constant with which what is found is applied

}  // namespace

Calibrator::Calibrator(std::shared_ptr<const robot::RobotModel> model, bool enabled, double period)
    : model_(std::move(model)),
      enabled_(enabled),
      filter_(12, kObserverCutoff),
      input_(Eigen::VectorXd::Zero(12)),
      correlated_(std::max(1.0, 1 / (2 * kObserverCutoff * period))) {
  const double mass = model_->total_mass();
  covariance_.diagonal() << Square(kStartMass * mass),
      Vector3d::Constant(Square(kStartShift * mass));
}

void Calibrator::Track(const robot::FootArray<robot::Vector6d>& wrench, double dt) {
  for (const Foot f : kFeet) input_.segment<6>(6 * static_cast<Eigen::Index>(f)) = wrench[f];
  if (started_) {
    filter_.Step(input_, dt);
  } else {
    filter_.Reset(input_);
  }
  started_ = true;
  since_ += dt;
  const double mass = model_->total_mass();
  Load wanted = estimate_;
  wanted[0] = std::clamp(wanted[0], -kMaxMass * mass, kMaxMass * mass);
  const double reach = kMaxShift * mass;
  for (int i = 1; i < 4; ++i) wanted[i] = std::clamp(wanted[i], -reach, reach);
  applied_ += std::min(dt / kApplyTime, 1.0) * (wanted - applied_);
}

void Calibrator::Update(const WrenchObserver& observer, bool usable) {
  const Vector3d& s = observer.specific_force();
  const Vector3d& w = observer.data().body_angular_velocity[0];
  running_ =
      usable && w.norm() < kStillRate && std::abs(s.norm() - robot::kGravity) < kStillAcceleration;
  if (!running_) return;
  // Environment on robot, base axes, about the base's origin.
  robot::Vector6d ground = robot::Vector6d::Zero();
  for (const Foot f : kFeet) {
    const robot::Vector6d wrench = -filter_.value().segment<6>(6 * static_cast<Eigen::Index>(f));
    const Vector3d force = observer.sole_rotation(f) * wrench.head<3>();
    ground.head<3>() += force;
    ground.tail<3>() +=
        observer.sole_rotation(f) * wrench.tail<3>() + observer.sole_position(f).cross(force);
  }
  Eigen::Matrix<double, 6, 4> regressor = Eigen::Matrix<double, 6, 4>::Zero();
  regressor.block<3, 1>(0, 0) = s;
  regressor.block<3, 3>(0, 1) = Skew(observer.base_turn()) + SkewSquared(w, w.squaredNorm());
  regressor.block<3, 3>(3, 1) = -Skew(s);
  Correct(regressor, ground - observer.base_wrench());
}

void Calibrator::Correct(const Eigen::Matrix<double, 6, 4>& regressor,
                         const robot::Vector6d& measured) {
  const double mass = model_->total_mass();
  const double dt = std::max(since_, 0.0);
  since_ = 0;
  covariance_.diagonal().head<3>().array() += Square(kWalk * mass) * dt;
  const robot::Vector6d gap = measured - regressor * estimate_;
  Eigen::Matrix<double, 6, 1> noise;
  noise.head<3>().setConstant(correlated_ * Square(kForceError));
  noise.tail<3>().setConstant(correlated_ * Square(kMomentError));
  const Eigen::Matrix<double, 4, 6> cross = covariance_ * regressor.transpose();
  Eigen::Matrix<double, 6, 6> total = regressor * cross;
  total.diagonal() += noise;
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> factors(total);
  const double difference = gap.dot(factors.solve(gap));
  // Something else pushes the robot, or a reading is wrong.
  if (!(difference < kOutlierGate)) {
    running_ = false;
    return;
  }
  Eigen::Matrix<double, 4, 6> gain = factors.solve(cross.transpose()).transpose();
  gain.row(3).setZero();  // considered
  estimate_ += gain * gap;
  // Joseph's form, which holds for any gain.
  const Eigen::Matrix4d left = Eigen::Matrix4d::Identity() - gain * regressor;
  covariance_ =
      left * covariance_ * left.transpose() + gain * noise.asDiagonal() * gain.transpose();
}

void Calibrator::Archive(StateArchive* archive) {
  filter_.Archive(archive);
  archive->Show(estimate_, applied_, covariance_, since_, running_, started_);
}

}  // namespace poise
