#include "components/balance/step/box_lcp.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <random>

namespace poise::balance {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Problem {
  MatrixXd a;
  VectorXd q, lower, upper;
};

// `stiff`: the smallest eigenvalues are 1e-6 of the largest, as with many points under one sole.
Problem Draw(int n, bool stiff, std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto draw = [&] { return normal(*random); };
  Problem problem;
  const MatrixXd root = MatrixXd::NullaryExpr(n, stiff ? std::max(1, n / 2) : n, draw);
  problem.a = root * root.transpose() + (stiff ? 1e-6 : 1e-2) * MatrixXd::Identity(n, n);
  problem.q = VectorXd::NullaryExpr(n, draw);
  problem.lower = VectorXd::NullaryExpr(n, [&] { return -uniform(*random); });
  problem.upper = VectorXd::NullaryExpr(n, [&] { return uniform(*random); });
  for (int i = 0; i < n; ++i) {
    const double kind = uniform(*random);
    if (kind < 0.3) {
      problem.lower[i] = 0;
      problem.upper[i] = std::numeric_limits<double>::infinity();
    } else if (kind < 0.4) {
      problem.lower[i] = problem.upper[i] = 0;
    } else if (kind < 0.5) {
      problem.lower[i] = -std::numeric_limits<double>::infinity();
      problem.upper[i] = std::numeric_limits<double>::infinity();
    }
  }
  return problem;
}

// By trying all 3^n sides.
VectorXd TryAll(const Problem& problem) {
  const auto n = static_cast<int>(problem.q.size());
  int combinations = 1;
  for (int i = 0; i < n; ++i) combinations *= 3;
  VectorXd best;
  double least = std::numeric_limits<double>::infinity();
  for (int code = 0; code < combinations; ++code) {
    MatrixXd a = MatrixXd::Identity(n, n);
    VectorXd q(n);
    int rest = code;
    bool possible = true;
    for (int i = 0; i < n; ++i, rest /= 3) {
      if (rest % 3 == 1) {
        a.row(i) = problem.a.row(i);
        q[i] = problem.q[i];
        continue;
      }
      q[i] = rest % 3 == 0 ? problem.lower[i] : problem.upper[i];
      possible = possible && std::isfinite(q[i]);
    }
    if (!possible) continue;
    const VectorXd x = a.fullPivLu().solve(q);
    const VectorXd w = problem.a * x - problem.q;
    double worst = 0;
    rest = code;
    for (int i = 0; i < n; ++i, rest /= 3) {
      worst = std::max({worst, problem.lower[i] - x[i], x[i] - problem.upper[i]});
      if (rest % 3 == 0 && problem.lower[i] < problem.upper[i]) worst = std::max(worst, -w[i]);
      if (rest % 3 == 2 && problem.lower[i] < problem.upper[i]) worst = std::max(worst, w[i]);
    }
    if (worst < least) {
      least = worst;
      best = x;
    }
  }
  return best;
}

TEST(BoxLcp, FindsWhatTryingAllSidesFinds) {
  std::mt19937_64 random(1);
  BoxLcp lcp(6);
  for (int trial = 0; trial < 300; ++trial) {
    const Problem problem = Draw(1 + trial % 6, false, &random);
    VectorXd x(problem.q.size());
    ASSERT_TRUE(lcp.Solve(problem.a, problem.q, problem.lower, problem.upper, x));
    const VectorXd expected = TryAll(problem);
    EXPECT_LT((x - expected).norm(), 1e-8 * (1 + expected.norm())) << "trial " << trial;
  }
}

// The conditions themselves, on problems as large and as stiff as a standing robot's.
TEST(BoxLcp, MeetsTheConditionsFromAnyGuess) {
  std::mt19937_64 random(2);
  BoxLcp lcp(24);
  for (int trial = 0; trial < 3000; ++trial) {
    const Problem problem = Draw(24, true, &random);  // the last one's sides are a bad guess
    VectorXd x(24);
    ASSERT_TRUE(lcp.Solve(problem.a, problem.q, problem.lower, problem.upper, x));
    const VectorXd w = problem.a * x - problem.q;
    const double tolerance = 1e-9 * (1 + (problem.a.cwiseAbs() * x.cwiseAbs()).maxCoeff());
    for (int i = 0; i < 24; ++i) {
      EXPECT_GE(x[i], problem.lower[i]);
      EXPECT_LE(x[i], problem.upper[i]);
      if (x[i] > problem.lower[i]) {
        EXPECT_LT(w[i], tolerance);
      }
      if (x[i] < problem.upper[i]) {
        EXPECT_GT(w[i], -tolerance);
      }
    }
  }
}

TEST(BoxLcp, RefusesWhatIsNotPositiveDefinite) {
  BoxLcp lcp(2);
  const MatrixXd a{{1, 2}, {2, 1}};
  VectorXd x(2);
  EXPECT_FALSE(
      lcp.Solve(a, VectorXd::Ones(2), VectorXd::Constant(2, -9), VectorXd::Constant(2, 9), x));
  EXPECT_FALSE(lcp.Solve(MatrixXd::Constant(2, 2, std::numeric_limits<double>::quiet_NaN()),
                         VectorXd::Ones(2), VectorXd::Constant(2, -9), VectorXd::Constant(2, 9),
                         x));
}

}  // namespace
}  // namespace poise::balance
