#include "tools/robot_import/inertia_repair.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace poise {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDensity = 1000;  // kg/m³: machines are near that of water
// A repaired inertia keeps this share of its trace from the edge of what is possible: rounding to
// the ten digits of a text must not cross it.
constexpr double kInside = 1e-9;
// The products of inertia with the axis are at most this share of the moment about it.
constexpr double kAcross = 0.2;

/// Second moments ∫ x² dm about the principal axes: all are ≥ 0 where moments are physical.
Vector3d SecondMoments(const Vector3d& moments) {
  return Vector3d::Constant(0.5 * moments.sum()) - moments;
}

}  // namespace

std::optional<double> HiddenRotor(const Matrix3d& inertia, const Vector3d& axis) {
  const Vector3d a = axis.normalized();
  Matrix3d frame;
  frame.col(0) = a;
  frame.col(1) = a.unitOrthogonal();
  frame.col(2) = a.cross(frame.col(1));
  const Matrix3d turned = frame.transpose() * inertia * frame;
  const double about = turned(0, 0);
  const Vector3d across(turned(0, 1), turned(0, 2), 0);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> rest(
      Eigen::Matrix2d(turned.bottomRightCorner<2, 2>()), Eigen::EigenvaluesOnly);
  const double smaller = rest.eigenvalues()[0], larger = rest.eigenvalues()[1];
  if (smaller < 0 || about <= smaller + larger || across.norm() > kAcross * about) return {};
  return about - larger;
}

Matrix3d NearestPhysical(const Matrix3d& inertia) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(0.5 * (inertia + inertia.transpose()));
  Vector3d moments = solver.eigenvalues();
  // At most one second moment of a body with a positive trace is far below 0: each round puts the
  // lowest onto its plane, moments_i = the sum of the others.
  for (int round = 0; round < 3; ++round) {
    const double least = kInside * std::max(moments.sum(), 0.0);
    const Vector3d second = SecondMoments(moments);
    Eigen::Index i = 0;
    const double lowest = second.minCoeff(&i);
    if (lowest >= least) break;
    Vector3d normal = Vector3d::Constant(0.5);
    normal[i] = -0.5;
    moments += (least - lowest) / normal.squaredNorm() * normal;
  }
  moments = moments.cwiseMax(0);
  return solver.eigenvectors() * moments.asDiagonal() * solver.eigenvectors().transpose();
}

Matrix3d SphereInertia(double mass) {
  const double radius = std::cbrt(3 * mass / (4 * std::numbers::pi * kDensity));
  return 0.4 * mass * radius * radius * Matrix3d::Identity();
}

}  // namespace poise
