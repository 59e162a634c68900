#include "components/state_estimator/invariant_filter.h"

#include <Eigen/Cholesky>

#include "components/state_estimator/sole_kinematics.h"

namespace poise {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using robot::Foot;
using robot::kFeet;

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
  // What rounding left of the corrections since the last step goes here, too.
  state_.rotation = Orthonormal(r * gamma.zero);
  for (Matrix3d& rotation : state_.foot_rotation) rotation = Orthonormal(rotation);

  // Φ = I + E. E has rows for what turns and moves (R, v, p, soles: kMoved of them), columns for R,
  // v and the biases.
  constexpr int kMoved = kGyroBias, kRested = kSize - kMoved;
  Eigen::Matrix<double, kMoved, 3> by_gyro = Eigen::Matrix<double, kMoved, 3>::Zero();
  by_gyro.middleRows<3>(kRotation) = -dt * r;
  by_gyro.middleRows<3>(kVelocity) = -(dt * Skew(v) + 0.5 * dt * dt * Skew(gravity)) * r;
  by_gyro.middleRows<3>(kPosition) = -(dt * Skew(p) + 0.5 * dt * dt * Skew(v)) * r;
  for (const Foot f : kFeet) {
    if (holds_position_[f]) by_gyro.middleRows<3>(FootRow(f)) = -dt * Skew(state_.foot[f]) * r;
  }
  Eigen::Matrix<double, 6, 3> by_rotation, by_accelerometer;  // rows for v and p
  by_rotation << dt * Skew(gravity), 0.5 * dt * dt * Skew(gravity);
  by_accelerometer << -dt * r, -0.5 * dt * dt * r;
  const auto times_e_transposed = [&](const auto& m, auto* x) {
    *x = m.template middleCols<3>(kGyroBias).lazyProduct(by_gyro.transpose());
    x->template middleCols<6>(kVelocity) +=
        m.template middleCols<3>(kRotation).lazyProduct(by_rotation.transpose()) +
        m.template middleCols<3>(kAccelerometerBias).lazyProduct(by_accelerometer.transpose());
    x->template middleCols<3>(kPosition) += dt * m.template middleCols<3>(kVelocity);
  };

  // P ← Φ P Φᵀ + E N Eᵀ: the gyro's noise turns everything and the accelerometer's pushes as their
  // biases do, held over the step. With X = P Eᵀ, P ← P + X + Xᵀ + E (X + N Eᵀ).
  Covariance& c = covariance_;
  Eigen::Matrix<double, kSize, kMoved> x;
  times_e_transposed(c, &x);
  // Rows are filled up to whole registers.
  Eigen::Matrix<double, kMoved + 1, kSize> x_t;
  x_t << x.transpose(), Eigen::Matrix<double, 1, kSize>::Zero();
  c.bottomLeftCorner<kRested, kMoved>() += x.bottomRows<kRested>();
  c.topRightCorner<kMoved, kRested>() += x_t.topRightCorner<kMoved, kRested>();
  x_t.block<kMoved, 3>(0, kGyroBias) += by_gyro.lazyProduct(imu.angular_velocity_noise);
  x_t.block<6, 3>(kVelocity, kAccelerometerBias) +=
      by_accelerometer.lazyProduct(imu.acceleration_noise);
  // What is added to its own transpose is symmetric to the last bit.
  Eigen::Matrix<double, kMoved + 1, kMoved> y;
  times_e_transposed(x_t, &y);
  y = x_t.leftCols<kMoved>() + 0.5 * y;
  c.topLeftCorner<kMoved, kMoved>() += y.topRows<kMoved>() + y.topRows<kMoved>().transpose();
  c.diagonal().segment<3>(kGyroBias).array() += imu.gyro_bias_walk * imu.gyro_bias_walk * dt;
  c.diagonal().segment<3>(kAccelerometerBias).array() +=
      imu.accelerometer_bias_walk * imu.accelerometer_bias_walk * dt;
}

void InvariantFilter::Loosen(Foot foot, double position_variance, double rotation_variance) {
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
  if (!(variance > 0)) return;
  covariance_ -= spread / variance * spread.transpose();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
}

void InvariantFilter::CopyRows(int from, int to, const Vector3d& by_compliance,
                               const Matrix3d& noise) {
  ClearRows(to);
  Covariance& c = covariance_;
  c.middleRows<3>(to) = (c.middleRows<3>(from) + by_compliance * c.row(kCompliance)).eval();
  c.middleCols<3>(to) =
      (c.middleCols<3>(from) + c.col(kCompliance) * by_compliance.transpose()).eval();
  c.block<3, 3>(to, to) += noise;
  c.block<3, 3>(to, to) =
      (0.5 * (c.block<3, 3>(to, to) + c.block<3, 3>(to, to).transpose())).eval();
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
  return RotationExp((state_.compliance - reading.compliance) * reading.by_compliance.tail<3>()) *
         state_.rotation * reading.rotation;
}

void InvariantFilter::HoldPosition(Foot foot, const SoleReading& reading) {
  state_.foot[foot] = SeenPosition(reading);
  // ξ_d = ξ_p + the reading's error.
  CopyRows(kPosition, FootRow(foot), reading.by_compliance.head<3>(),
           reading.noise.topLeftCorner<3, 3>());
  holds_position_[foot] = true;
}

void InvariantFilter::HoldRotation(Foot foot, const SoleReading& reading) {
  state_.foot_rotation[foot] = Orthonormal(SeenRotation(reading));
  CopyRows(kRotation, FootRotationRow(foot), reading.by_compliance.tail<3>(),
           reading.noise.bottomRightCorner<3, 3>());
  holds_rotation_[foot] = true;
}

void InvariantFilter::ReleasePosition(Foot foot) {
  if (holds_position(foot)) ClearRows(FootRow(foot));
  holds_position_[foot] = false;
}

void InvariantFilter::ReleaseRotation(Foot foot) {
  if (holds_rotation(foot)) ClearRows(FootRotationRow(foot));
  holds_rotation_[foot] = false;
}

// R̂ y − (d̂ − p̂) = ξ_p − ξ_d + the reading's error: exact in ξ, whatever the estimate; the reading's
// error is noise and what the compliance's error makes of it.
Vector3d InvariantFilter::PositionInnovation(Foot foot, const SoleReading& reading) const {
  return SeenPosition(reading) - state_.foot[foot];
}

// log(R̂ C F̂ᵀ) = ξ_R − ξ_F + the reading's error, to first order in ξ.
Vector3d InvariantFilter::RotationInnovation(Foot foot, const SoleReading& reading) const {
  return RotationLog(SeenRotation(reading) * state_.foot_rotation[foot].transpose());
}

InvariantFilter::Innovation InvariantFilter::Test(Foot foot, const SoleReading& reading) const {
  const auto spread = [&](int minuend, int subtrahend, const Vector3d& by_compliance) -> Matrix3d {
    const Covariance& c = covariance_;
    const Vector3d cross =
        c.block<3, 1>(minuend, kCompliance) - c.block<3, 1>(subtrahend, kCompliance);
    return c.block<3, 3>(minuend, minuend) + c.block<3, 3>(subtrahend, subtrahend) -
           c.block<3, 3>(minuend, subtrahend) - c.block<3, 3>(subtrahend, minuend) +
           cross * by_compliance.transpose() + by_compliance * cross.transpose() +
           c(kCompliance, kCompliance) * by_compliance * by_compliance.transpose();
  };
  // zᵀ S⁻¹ z by S = L D Lᵀ; 0 when S is not positive definite.
  const auto squared = [](const Vector3d& z, const Matrix3d& s) {
    const double l10 = s(1, 0) / s(0, 0), l20 = s(2, 0) / s(0, 0);
    const double d1 = s(1, 1) - l10 * s(1, 0), e21 = s(2, 1) - l20 * s(1, 0), l21 = e21 / d1;
    const double d2 = s(2, 2) - l20 * s(2, 0) - l21 * e21;
    if (!(s(0, 0) > 0 && d1 > 0 && d2 > 0)) return 0.0;
    const double y1 = z[1] - l10 * z[0], y2 = z[2] - l20 * z[0] - l21 * y1;
    return z[0] * z[0] / s(0, 0) + y1 * y1 / d1 + y2 * y2 / d2;
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

bool InvariantFilter::Correct(Foot foot, const SoleReading& reading) {
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
  // With S = L Lᵀ and W = P Hᵀ L⁻ᵀ the gain is W L⁻¹, and P ← P − W Wᵀ.
  const auto& l = factors.matrixLLT();
  Eigen::Matrix<double, kSize, N> w = ph;
  for (int j = 0; j < N; ++j) {
    for (int i = 0; i < j; ++i) w.col(j) -= w.col(i) * l(j, i);
    w.col(j) *= 1 / l(j, j);
  }
  const Error error = w.lazyProduct(factors.matrixL().solve(innovation));
  TakeOut(error);
  // Factors of a product commute: both halves get the same bits.
  covariance_ -= w.lazyProduct(w.transpose());
  return true;
}

void InvariantFilter::TakeOut(const Error& error) {
  const Gamma gamma(-error.segment<3>(kRotation));
  const auto vector = [&](const Vector3d& value, int row) -> Vector3d {
    return gamma.zero * value - gamma.one * error.segment<3>(row);
  };
  state_.rotation = gamma.zero * state_.rotation;
  state_.velocity = vector(state_.velocity, kVelocity);
  state_.position = vector(state_.position, kPosition);
  for (const Foot f : kFeet) {
    state_.foot[f] = vector(state_.foot[f], FootRow(f));
    state_.foot_rotation[f] =
        RotationExp(-error.segment<3>(FootRotationRow(f))) * state_.foot_rotation[f];
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
