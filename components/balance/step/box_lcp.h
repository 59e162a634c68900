// A linear complementarity problem with bounds on both sides.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace poise::balance {

/// Finds x with lower <= x <= upper and w = A x - q, where w[i] = 0 if x[i] lies between its
/// bounds, w[i] >= 0 on the lower one and w[i] <= 0 on the upper one. A is symmetric and positive
/// definite: there is exactly one such x.
///
/// Block principal pivoting (Júdice and Pires 1994): a guess of the rows that are free, a Cholesky
/// factorisation of those, and the rows that contradict the guess change sides. The first guess is
/// the last solution's, so most problems of a simulation take one factorisation. Where pivoting
/// goes round, an active set method that descends ends it.
class BoxLcp {
 public:
  using Matrix = Eigen::Ref<const Eigen::MatrixXd>;
  using Vector = Eigen::Ref<const Eigen::VectorXd>;
  using Result = Eigen::Ref<Eigen::VectorXd>;

  /// Room for `capacity` rows; nothing is allocated later.
  explicit BoxLcp(int capacity);

  /// Starts the next problem with every row free. A change of size does so too.
  void Forget() { rows_ = 0; }

  /// A: n × n, of which the lower triangle is read; q, lower, upper, x: n. Bounds may be infinite.
  /// False, and x is of no use, when A is not positive definite or the pivoting did not end.
  bool Solve(const Matrix& a, const Vector& q, const Vector& lower, const Vector& upper, Result x);

 private:
  enum class Side : signed char { kLower, kFree, kUpper };
  bool SolveFree(const Matrix& a, const Vector& q, const Vector& lower, const Vector& upper,
                 Result x);
  double Pull(const Matrix& a, const Vector& q, const Vector& x, int i) const;
  bool Guess(const Matrix& a, const Vector& q, const Vector& lower, const Vector& upper, Result x);
  bool Descend(const Matrix& a, const Vector& q, const Vector& lower, const Vector& upper,
               Result x);

  int rows_ = 0;
  std::vector<Side> side_;
  std::vector<Side> next_;
  std::vector<int> free_;
  Eigen::MatrixXd factor_;
  Eigen::VectorXd rest_;
  Eigen::VectorXd point_;  // within the bounds, of the descent
};

}  // namespace poise::balance
