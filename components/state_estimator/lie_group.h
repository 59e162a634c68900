// Closed forms of the rotation group and of SE_K(3): a rotation with K vectors that it turns.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace poise {

/// v^×: Skew(v) w = v × w.
inline Eigen::Matrix3d Skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// (v^×)² = v vᵀ − |v|² I.
inline Eigen::Matrix3d SkewSquared(const Eigen::Vector3d& v, double squared_norm) {
  Eigen::Matrix3d m = v * v.transpose();
  m.diagonal().array() -= squared_norm;
  return m;
}

/// Γ_m(φ) = Σ_n (φ^×)ⁿ / (n + m)!, (Hartley et al. 2020, appendix): Γ_0 is the rotation about φ by
/// |φ|, Γ_1 the left Jacobian, and with a rate φ = ω t Γ_1 and Γ_2 integrate it once and twice.
/// Below 0.05 rad by series, to rounding.
struct Gamma {
  Eigen::Matrix3d zero, one, two;

  explicit Gamma(const Eigen::Vector3d& rotation) {
    const double x2 = rotation.squaredNorm(), x = std::sqrt(x2);
    // (1 − cos x)/x², sin x/x, (x − sin x)/x³, (x² + 2 cos x − 2)/(2 x⁴)
    double cosine, sine, third, fourth;
    if (x < 0.05) {
      cosine = 0.5 - x2 * (1.0 / 24 - x2 * (1.0 / 720 - x2 / 40320));
      sine = 1 - x2 * (1.0 / 6 - x2 * (1.0 / 120 - x2 / 5040));
      third = 1.0 / 6 - x2 * (1.0 / 120 - x2 * (1.0 / 5040 - x2 / 362880));
      fourth = 1.0 / 24 - x2 * (1.0 / 720 - x2 * (1.0 / 40320 - x2 / 3628800));
    } else {
      cosine = (1 - std::cos(x)) / x2;
      sine = std::sin(x) / x;
      third = (x - std::sin(x)) / (x2 * x);
      fourth = (x2 + 2 * std::cos(x) - 2) / (2 * x2 * x2);
    }
    const Eigen::Matrix3d s = Skew(rotation), s2 = SkewSquared(rotation, x2);
    zero = Eigen::Matrix3d::Identity() + sine * s + cosine * s2;
    one = Eigen::Matrix3d::Identity() + cosine * s + third * s2;
    two = 0.5 * Eigen::Matrix3d::Identity() + third * s + fourth * s2;
  }
};

/// Γ_0 alone.
inline Eigen::Matrix3d RotationExp(const Eigen::Vector3d& rotation) {
  const double x2 = rotation.squaredNorm(), x = std::sqrt(x2);
  double cosine, sine;
  if (x < 0.05) {
    cosine = 0.5 - x2 * (1.0 / 24 - x2 * (1.0 / 720 - x2 / 40320));
    sine = 1 - x2 * (1.0 / 6 - x2 * (1.0 / 120 - x2 / 5040));
  } else {
    cosine = (1 - std::cos(x)) / x2;
    sine = std::sin(x) / x;
  }
  return Eigen::Matrix3d::Identity() + sine * Skew(rotation) + cosine * SkewSquared(rotation, x2);
}

/// Rotation vector of a rotation, of length up to π. Below 0.05 rad by series, to rounding.
inline Eigen::Vector3d RotationLog(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d axis(rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
                             rotation(1, 0) - rotation(0, 1));  // 2 sin θ long
  const double s2 = 0.25 * axis.squaredNorm();
  if (s2 < 0.0025 && rotation.trace() > 1) {
    // asin(s) / s
    const double series =
        1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336 + s2 * (105.0 / 3456))));
    return (0.5 * series) * axis;
  }
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  // 2 atan2(s, w) / s, which tends to 2.
  const double scale = sine > 1e-10 ? 2 * std::atan2(sine, q.w()) / sine : 2.0;
  return scale * q.vec();
}

}  // namespace poise
