// Random states of two real robots, and the paper's matrices as the paper writes them.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "components/balance/task_dynamics.h"
#include "components/balance/whole_body.h"

namespace poise::balance {

/// Oracles run in extended precision: their own rounding must not show at 1e-9.
using Real = long double;
using MatrixL = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using VectorL = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

inline constexpr std::array<bool, 2> kDouble{true, true}, kRight{true, false}, kLeft{false, true};

/// The default robot (12 joints: compile-time sizes) and one with a waist, arms and another joint
/// order.
std::shared_ptr<const robot::RobotModel> Biped();
std::shared_ptr<const robot::RobotModel> Humanoid();

/// Random joints within their limits, random base pose and velocities. Straight legs, for which no
/// contact dynamics exist, are drawn again.
class StateSampler {
 public:
  StateSampler(std::shared_ptr<const robot::RobotModel> model, unsigned seed);
  robot::RobotState Draw();
  double Uniform(double low, double high);
  Eigen::VectorXd Vector(Eigen::Index size, double magnitude);

 private:
  std::shared_ptr<const robot::RobotModel> model_;
  std::mt19937_64 random_;
};

/// Stacked tasks of the paper's experiments: COM, body orientation and, in single support, the free
/// foot's pose.
struct StackedTask {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd bias_acceleration;
};
StackedTask PaperTask(const WholeBody& body, const std::array<bool, 2>& in_contact);
/// Height of the COM.
StackedTask ComHeight(const WholeBody& body);

/// Sections 3 and (22), formula by formula, with dense inverses.
struct PaperContact {
  PaperContact(const WholeBody& body, const std::array<bool, 2>& in_contact);

  Eigen::Index k, n, m;
  MatrixL a, jc, a_inverse, lambda_c, jc_bar_t, nc_t, s, w, w_pinv;
  MatrixL null_basis;  ///< V₂ of (49), k×(m−6)
  VectorL b, g, gamma, mu_c, p_c;

  /// q̈ and contact wrenches from the equations of motion and the contact constraints alone.
  void Solve(const VectorL& torque, VectorL* acceleration, VectorL* wrench) const;
};

struct PaperTaskSpace {
  PaperTaskSpace(const PaperContact& contact, const StackedTask& task);
  MatrixL j, lambda, j_bar_t, q, j_tilde_t, n_tilde_t;
  VectorL bias_acceleration, mu, p;
};

/// max |x − y| over 1 + max |y|. NaN counts as infinite.
double MaxResidual(const MatrixL& x, const MatrixL& y);
template <class X, class Y>
double Residual(const Eigen::MatrixBase<X>& x, const Eigen::MatrixBase<Y>& y) {
  return MaxResidual(x.template cast<Real>(), y.template cast<Real>());
}

}  // namespace poise::balance
