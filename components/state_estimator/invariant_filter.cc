#include "components/state_estimator/invariant_filter.h"

#include <Eigen/Cholesky>

#include "components/state_estimator/sole_kinematics.h"

namespace poise {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void InvariantFilter::Set(const InvariantState& state, const Covariance& covariance) {
  state_ = state;
  covariance_ = 0.5 * (covariance + covariance.transpose());
  holds_position_.fill(false);
  holds_rotation_.fill(false);
}

void InvariantFilter::Propagate(const ImuStep& imu, double dt) {
  const Matrix3d r = state_.rotation;
  const Vector3d v = state_.velocity, p = state_.position;
  const Vector3d gravity(0, 0, -gravity_);
  const Vector3d rate = imu.angular_velocity - state_.gyro_bias;
  const Vector3d force = imu.acceleration - state_.accelerometer_bias;
  const Gamma gamma(dt * rate);
  state_.position = p + dt * v + 0.5 * dt * dt * gravity + dt * dt * (r * (gamma.two * force));
  state_.velocity = v + dt * gravity + dt * (r * (gamma.one * force));
  state_.rotation = Orthonormal(r * gamma.zero);

  // Φ is the identity but for the blocks below; P ← Φ P Φᵀ row by row, then column by column.
  // Position and velocity need the rows of before and come first.
  const Matrix3d fall = dt * Skew(gravity);
  const Matrix3d half_fall = 0.5 * dt * fall;
  const Matrix3d v_turn = -(dt * Skew(v) + half_fall) * r;
  const Matrix3d p_turn = -(dt * Skew(p) + 0.5 * dt * dt * Skew(v)) * r;
  const std::array<Matrix3d, 2> foot_turn = {-dt * Skew(state_.foot[0]) * r,
                                             -dt * Skew(state_.foot[1]) * r};
  Covariance& c = covariance_;
  const auto rows = [&](int row) { return c.middleRows<3>(row); };
  const auto columns = [&](int column) { return c.middleCols<3>(column); };
  rows(kPosition).noalias() += dt * rows(kVelocity);
  rows(kPosition).noalias() += half_fall * rows(kRotation);
  rows(kPosition).noalias() += p_turn * rows(kGyroBias);
  rows(kPosition).noalias() -= (0.5 * dt * dt * r) * rows(kAccelerometerBias);
  rows(kVelocity).noalias() += fall * rows(kRotation);
  rows(kVelocity).noalias() += v_turn * rows(kGyroBias);
  rows(kVelocity).noalias() -= (dt * r) * rows(kAccelerometerBias);
  rows(kRotation).noalias() -= (dt * r) * rows(kGyroBias);
  columns(kPosition).noalias() += dt * columns(kVelocity);
  columns(kPosition).noalias() += columns(kRotation) * half_fall.transpose();
  columns(kPosition).noalias() += columns(kGyroBias) * p_turn.transpose();
  columns(kPosition).noalias() -= columns(kAccelerometerBias) * (0.5 * dt * dt * r).transpose();
  columns(kVelocity).noalias() += columns(kRotation) * fall.transpose();
  columns(kVelocity).noalias() += columns(kGyroBias) * v_turn.transpose();
  columns(kVelocity).noalias() -= columns(kAccelerometerBias) * (dt * r).transpose();
  columns(kRotation).noalias() -= columns(kGyroBias) * (dt * r).transpose();
  for (int foot = 0; foot < 2; ++foot) {
    if (!holds_position(foot)) continue;
    rows(FootRow(foot)).noalias() += foot_turn[static_cast<size_t>(foot)] * rows(kGyroBias);
    columns(FootRow(foot)).noalias() +=
        columns(kGyroBias) * foot_turn[static_cast<size_t>(foot)].transpose();
  }

  // Noise of the gyro turns everything, that of the accelerometer pushes; both hold over the step.
  Eigen::Matrix<double, kSize, 3> turn = Eigen::Matrix<double, kSize, 3>::Zero(), push = turn;
  turn.middleRows<3>(kRotation) = dt * r;
  turn.middleRows<3>(kVelocity) = -v_turn;
  turn.middleRows<3>(kPosition) = -p_turn;
  for (int foot = 0; foot < 2; ++foot) {
    if (holds_position(foot)) {
      turn.middleRows<3>(FootRow(foot)) = -foot_turn[static_cast<size_t>(foot)];
    }
  }
  push.middleRows<3>(kVelocity) = dt * r;
  push.middleRows<3>(kPosition) = 0.5 * dt * dt * r;
  constexpr int kTurned = kGyroBias;  // rows before it
  const Eigen::Matrix<double, kTurned, 3> turned =
      turn.topRows<kTurned>() * imu.angular_velocity_noise;
  const Eigen::Matrix<double, kTurned, 3> pushed = push.topRows<kTurned>() * imu.acceleration_noise;
  c.topLeftCorner<kTurned, kTurned>().noalias() += turned * turn.topRows<kTurned>().transpose();
  c.topLeftCorner<kTurned, kTurned>().noalias() += pushed * push.topRows<kTurned>().transpose();
  c.diagonal().segment<3>(kGyroBias).array() += imu.gyro_bias_walk * imu.gyro_bias_walk * dt;
  c.diagonal().segment<3>(kAccelerometerBias).array() +=
      imu.accelerometer_bias_walk * imu.accelerometer_bias_walk * dt;
  c = (0.5 * (c + c.transpose())).eval();
}

void InvariantFilter::Loosen(int foot, double position_variance, double rotation_variance) {
  if (holds_position(foot)) {
    covariance_.diagonal().segment<3>(FootRow(foot)).array() += position_variance;
  }
  if (holds_rotation(foot)) {
    covariance_.diagonal().segment<3>(FootRotationRow(foot)).array() += rotation_variance;
  }
}

void InvariantFilter::Doubt(double rotation_variance, double velocity_variance,
                            double position_variance) {
  covariance_.diagonal().segment<3>(kRotation).array() += rotation_variance;
  covariance_.diagonal().segment<3>(kVelocity).array() += velocity_variance;
  covariance_.diagonal().segment<3>(kPosition).array() += position_variance;
}

void InvariantFilter::Know(const Error& row, double deviation) {
  const Error spread = covariance_ * row;
  const double variance = row.dot(spread) + deviation * deviation;
  if (variance > 0) covariance_ -= spread / variance * spread.transpose();
}

void InvariantFilter::CopyRows(int from, int to, const Vector3d& by_compliance,
                               const Matrix3d& noise) {
  ClearRows(to);
  Covariance& c = covariance_;
  c.middleRows<3>(to) = (c.middleRows<3>(from) + by_compliance * c.row(kCompliance)).eval();
  c.middleCols<3>(to) =
      (c.middleCols<3>(from) + c.col(kCompliance) * by_compliance.transpose()).eval();
  c.block<3, 3>(to, to) += noise;
}

void InvariantFilter::ClearRows(int row) {
  covariance_.middleRows<3>(row).setZero();
  covariance_.middleCols<3>(row).setZero();
}

Vector3d InvariantFilter::SeenPosition(const SoleReading& reading) const {
  return state_.position + state_.rotation * reading.position +
         (state_.compliance - reading.compliance) * reading.by_compliance.head<3>();
}

Matrix3d InvariantFilter::SeenRotation(const SoleReading& reading) const {
  const Gamma turn((state_.compliance - reading.compliance) * reading.by_compliance.tail<3>());
  return turn.zero * state_.rotation * reading.rotation;
}

void InvariantFilter::HoldPosition(int foot, const SoleReading& reading) {
  const auto f = static_cast<size_t>(foot);
  state_.foot[f] = SeenPosition(reading);
  // ξ_d = ξ_p + the reading's error.
  CopyRows(kPosition, FootRow(foot), reading.by_compliance.head<3>(),
           reading.noise.topLeftCorner<3, 3>());
  holds_position_[f] = true;
}

void InvariantFilter::HoldRotation(int foot, const SoleReading& reading) {
  const auto f = static_cast<size_t>(foot);
  state_.foot_rotation[f] = Orthonormal(SeenRotation(reading));
  CopyRows(kRotation, FootRotationRow(foot), reading.by_compliance.tail<3>(),
           reading.noise.bottomRightCorner<3, 3>());
  holds_rotation_[f] = true;
}

void InvariantFilter::ReleasePosition(int foot) {
  if (holds_position(foot)) ClearRows(FootRow(foot));
  holds_position_[static_cast<size_t>(foot)] = false;
}

void InvariantFilter::ReleaseRotation(int foot) {
  if (holds_rotation(foot)) ClearRows(FootRotationRow(foot));
  holds_rotation_[static_cast<size_t>(foot)] = false;
}

// R̂ y − (d̂ − p̂) = ξ_p − ξ_d + the reading's error: exact in ξ, whatever the estimate; the reading's
// error is noise and what the compliance's error makes of it.
Vector3d InvariantFilter::PositionInnovation(int foot, const SoleReading& reading) const {
  return SeenPosition(reading) - state_.foot[static_cast<size_t>(foot)];
}

// log(R̂ C F̂ᵀ) = ξ_R − ξ_F + the reading's error, to first order in ξ.
Vector3d InvariantFilter::RotationInnovation(int foot, const SoleReading& reading) const {
  return RotationLog(SeenRotation(reading) *
                     state_.foot_rotation[static_cast<size_t>(foot)].transpose());
}

InvariantFilter::Innovation InvariantFilter::Test(int foot, const SoleReading& reading) const {
  const auto spread = [&](int minuend, int subtrahend, const Vector3d& by_compliance) -> Matrix3d {
    const Covariance& c = covariance_;
    const Vector3d cross =
        c.block<3, 1>(minuend, kCompliance) - c.block<3, 1>(subtrahend, kCompliance);
    return c.block<3, 3>(minuend, minuend) + c.block<3, 3>(subtrahend, subtrahend) -
           c.block<3, 3>(minuend, subtrahend) - c.block<3, 3>(subtrahend, minuend) +
           cross * by_compliance.transpose() + by_compliance * cross.transpose() +
           c(kCompliance, kCompliance) * by_compliance * by_compliance.transpose();
  };
  const auto squared = [](const Vector3d& z, const Matrix3d& s) {
    const Eigen::LLT<Matrix3d> factors(s);
    return factors.info() == Eigen::Success ? z.dot(factors.solve(z)) : 0.0;
  };
  Innovation result;
  if (holds_position(foot)) {
    result.position = squared(PositionInnovation(foot, reading),
                              spread(kPosition, FootRow(foot), reading.by_compliance.head<3>()) +
                                  reading.noise.topLeftCorner<3, 3>());
  }
  if (holds_rotation(foot)) {
    result.rotation =
        squared(RotationInnovation(foot, reading),
                spread(kRotation, FootRotationRow(foot), reading.by_compliance.tail<3>()) +
                    reading.noise.bottomRightCorner<3, 3>());
  }
  return result;
}

bool InvariantFilter::Correct(int foot, const SoleReading& reading) {
  const Covariance& c = covariance_;
  Eigen::Matrix<double, kSize, 6> ph;  // P Hᵀ
  ph.leftCols<3>() = c.middleCols<3>(kPosition) - c.middleCols<3>(FootRow(foot));
  ph.rightCols<3>() = c.middleCols<3>(kRotation) - c.middleCols<3>(FootRotationRow(foot));
  ph.noalias() += c.col(kCompliance) * reading.by_compliance.transpose();
  Eigen::Matrix<double, 6, 6> s;
  s.topRows<3>() = ph.middleRows<3>(kPosition) - ph.middleRows<3>(FootRow(foot));
  s.bottomRows<3>() = ph.middleRows<3>(kRotation) - ph.middleRows<3>(FootRotationRow(foot));
  s.noalias() += reading.by_compliance * ph.row(kCompliance);
  s += reading.noise;
  if (holds_position(foot) && holds_rotation(foot)) {
    Eigen::Matrix<double, 6, 1> innovation;
    innovation << PositionInnovation(foot, reading), RotationInnovation(foot, reading);
    return CorrectRows<6>(innovation, ph, s);
  }
  if (holds_position(foot)) {
    return CorrectRows<3>(PositionInnovation(foot, reading), ph.leftCols<3>(),
                          s.topLeftCorner<3, 3>());
  }
  if (holds_rotation(foot)) {
    return CorrectRows<3>(RotationInnovation(foot, reading), ph.rightCols<3>(),
                          s.bottomRightCorner<3, 3>());
  }
  return true;
}

template <int N>
bool InvariantFilter::CorrectRows(const Eigen::Matrix<double, N, 1>& innovation,
                                  const Eigen::Matrix<double, kSize, N>& ph,
                                  const Eigen::Matrix<double, N, N>& s) {
  const Eigen::LLT<Eigen::Matrix<double, N, N>> factors(s);
  if (factors.info() != Eigen::Success) return false;
  const Eigen::Matrix<double, kSize, N> gain = factors.solve(ph.transpose()).transpose();
  TakeOut(gain * innovation);
  // Joseph's form (I − K H) P (I − K H)ᵀ + K N Kᵀ, multiplied out: symmetric for any gain.
  const Covariance half = gain * ph.transpose() - 0.5 * (gain * s) * gain.transpose();
  covariance_ -= half + half.transpose();
  return true;
}

void InvariantFilter::TakeOut(const Error& error) {
  const Gamma gamma(-error.segment<3>(kRotation));
  const auto vector = [&](const Vector3d& value, int row) -> Vector3d {
    return gamma.zero * value - gamma.one * error.segment<3>(row);
  };
  state_.rotation = Orthonormal(gamma.zero * state_.rotation);
  state_.velocity = vector(state_.velocity, kVelocity);
  state_.position = vector(state_.position, kPosition);
  for (int foot = 0; foot < 2; ++foot) {
    const auto f = static_cast<size_t>(foot);
    state_.foot[f] = vector(state_.foot[f], FootRow(foot));
    const Gamma turn(-error.segment<3>(FootRotationRow(foot)));
    state_.foot_rotation[f] = Orthonormal(turn.zero * state_.foot_rotation[f]);
  }
  state_.gyro_bias -= error.segment<3>(kGyroBias);
  state_.accelerometer_bias -= error.segment<3>(kAccelerometerBias);
  state_.compliance -= error[kCompliance];
}

void InvariantFilter::Archive(StateArchive* archive) {
  InvariantState& s = state_;
  archive->Show(s.rotation, s.velocity, s.position, s.foot, s.foot_rotation, s.gyro_bias,
                s.accelerometer_bias, s.compliance, covariance_, holds_position_, holds_rotation_);
}

}  // namespace poise
