#include "components/balance/step/box_lcp.h"

#include <algorithm>
#include <cmath>

namespace poise::balance {
namespace {

using Eigen::Index;

// A row that contradicts its side by less than this share of the largest x or q is rounding.
constexpr double kTolerance = 1e-11;
constexpr int kBlockMoves = 5;    // of block pivoting that may fail to help
constexpr int kMostMoves = 1000;  // of one row

// Runs down columns, which a compiler turns into vectors. L is written over the lower triangle,
// with 1 / L_kk on its diagonal. False when A is not positive definite.
bool Factor(double* a, Index n, Index stride) {
  for (Index k = 0; k < n; ++k) {
    double* const column = a + k * stride;
    if (!(column[k] > 0)) return false;
    const double inverse = 1 / std::sqrt(column[k]);
    column[k] = inverse;
    for (Index i = k + 1; i < n; ++i) column[i] *= inverse;
    for (Index j = k + 1; j < n; ++j) {
      double* const to = a + j * stride;
      const double share = column[j];
      for (Index i = j; i < n; ++i) to[i] -= share * column[i];
    }
  }
  return true;
}

void SolveFactored(const double* a, Index n, Index stride, double* x) {
  for (Index k = 0; k < n; ++k) {
    const double* const column = a + k * stride;
    x[k] *= column[k];
    for (Index i = k + 1; i < n; ++i) x[i] -= x[k] * column[i];
  }
  for (Index k = n; k-- > 0;) {
    const double* const column = a + k * stride;
    double sum = x[k];
    for (Index i = k + 1; i < n; ++i) sum -= column[i] * x[i];
    x[k] = sum * column[k];
  }
}

}  // namespace

BoxLcp::BoxLcp(int capacity)
    : side_(static_cast<size_t>(capacity)),
      next_(static_cast<size_t>(capacity)),
      free_(static_cast<size_t>(capacity)),
      factor_(capacity, capacity),
      rest_(capacity),
      point_(capacity) {}

bool BoxLcp::SolveFree(const Matrix& a, const Vector& q, const Vector& lower, const Vector& upper,
                       Result x) {
  size_t count = 0;
  bool pushed = false;
  for (int i = 0; i < rows_; ++i) {
    const Side side = side_[static_cast<size_t>(i)];
    if (side == Side::kFree) {
      free_[count++] = i;
      continue;
    }
    x[i] = side == Side::kLower ? lower[i] : upper[i];
    pushed = pushed || x[i] != 0;
  }
  const auto n = static_cast<Index>(count);
  for (Index c = 0; c < n; ++c) {
    const int column = free_[static_cast<size_t>(c)];
    rest_[c] = q[column];
    for (Index r = c; r < n; ++r) factor_(r, c) = a(free_[static_cast<size_t>(r)], column);
  }
  if (pushed) {
    for (int j = 0; j < rows_; ++j) {
      if (side_[static_cast<size_t>(j)] == Side::kFree || x[j] == 0) continue;
      for (Index r = 0; r < n; ++r) {
        const int i = free_[static_cast<size_t>(r)];
        rest_[r] -= a(std::max(i, j), std::min(i, j)) * x[j];
      }
    }
  }
  if (!Factor(factor_.data(), n, factor_.outerStride())) return false;
  SolveFactored(factor_.data(), n, factor_.outerStride(), rest_.data());
  for (Index r = 0; r < n; ++r) x[free_[static_cast<size_t>(r)]] = rest_[r];
  return true;
}

bool BoxLcp::Solve(const Matrix& a, const Vector& q, const Vector& lower, const Vector& upper,
                   Result x) {
  const auto n = static_cast<int>(q.size());
  if (n == 0) return true;
  if (n != rows_) {
    rows_ = n;
    std::fill_n(side_.begin(), n, Side::kFree);
  }
  for (int i = 0; i < n; ++i) {  // what the guess cannot be
    Side& side = side_[static_cast<size_t>(i)];
    if (lower[i] == upper[i]) {
      side = Side::kLower;
    } else if (side != Side::kFree && !std::isfinite(side == Side::kLower ? lower[i] : upper[i])) {
      side = Side::kFree;
    }
  }
  if (Guess(a, q, lower, upper, x) || Descend(a, q, lower, upper, x)) return true;
  Forget();
  return false;
}

// w of a row that is not free, counted as how much it wants to leave its bound.
double BoxLcp::Pull(const Matrix& a, const Vector& q, const Vector& x, int i) const {
  double w = -q[i];
  for (int j = 0; j < rows_; ++j) w += a(std::max(i, j), std::min(i, j)) * x[j];
  return side_[static_cast<size_t>(i)] == Side::kLower ? -w : w;
}

// Block pivoting: all rows that contradict their side change it, while that leaves fewer.
bool BoxLcp::Guess(const Matrix& a, const Vector& q, const Vector& lower, const Vector& upper,
                   Result x) {
  const double most_w = kTolerance * q.cwiseAbs().maxCoeff();
  int best = rows_ + 1;
  int patience = kBlockMoves;
  while (patience > 0) {
    if (!SolveFree(a, q, lower, upper, x)) return false;
    const double most_x = kTolerance * x.cwiseAbs().maxCoeff();
    if (!std::isfinite(most_x)) return false;
    int wrong = 0;
    for (int i = 0; i < rows_; ++i) {
      const Side side = side_[static_cast<size_t>(i)];
      Side next = side;
      if (side == Side::kFree) {
        if (x[i] < lower[i] - most_x) next = Side::kLower;
        if (x[i] > upper[i] + most_x) next = Side::kUpper;
      } else if (lower[i] < upper[i] && Pull(a, q, x, i) > most_w) {
        next = Side::kFree;
      }
      next_[static_cast<size_t>(i)] = next;
      if (next != side) ++wrong;
    }
    if (wrong == 0) {
      x = x.cwiseMax(lower).cwiseMin(upper);  // what is within the tolerance
      return true;
    }
    patience = wrong < best ? kBlockMoves : patience - 1;
    best = std::min(best, wrong);
    std::copy_n(next_.begin(), rows_, side_.begin());
  }
  return false;
}

// The active set method for the same problem as a quadratic program, min xᵀ A x / 2 - qᵀ x: each
// move lowers it, so no set of sides comes twice.
bool BoxLcp::Descend(const Matrix& a, const Vector& q, const Vector& lower, const Vector& upper,
                     Result x) {
  const double most_w = kTolerance * q.cwiseAbs().maxCoeff();
  for (int i = 0; i < rows_; ++i) {
    point_[i] = std::clamp(0.0, lower[i], upper[i]);
    side_[static_cast<size_t>(i)] = point_[i] == lower[i]   ? Side::kLower
                                    : point_[i] == upper[i] ? Side::kUpper
                                                            : Side::kFree;
  }
  for (int move = 0; move < kMostMoves; ++move) {
    if (!SolveFree(a, q, lower, upper, x)) return false;
    double share = 1;
    int stopped = -1;
    for (int i = 0; i < rows_; ++i) {
      if (side_[static_cast<size_t>(i)] != Side::kFree) continue;
      const double bound = std::clamp(x[i], lower[i], upper[i]);
      if (bound == x[i]) continue;
      const double ratio = (bound - point_[i]) / (x[i] - point_[i]);
      if (stopped >= 0 && ratio >= share) continue;
      share = ratio;
      stopped = i;
    }
    if (stopped >= 0) {
      for (int i = 0; i < rows_; ++i) {
        if (side_[static_cast<size_t>(i)] == Side::kFree) point_[i] += share * (x[i] - point_[i]);
      }
      const bool low = x[stopped] < lower[stopped];
      side_[static_cast<size_t>(stopped)] = low ? Side::kLower : Side::kUpper;
      point_[stopped] = low ? lower[stopped] : upper[stopped];
      continue;
    }
    point_.head(rows_) = x;
    double worst = most_w;
    int leaves = -1;
    for (int i = 0; i < rows_; ++i) {
      if (side_[static_cast<size_t>(i)] == Side::kFree || lower[i] == upper[i]) continue;
      const double pull = Pull(a, q, x, i);
      if (pull <= worst) continue;
      worst = pull;
      leaves = i;
    }
    if (leaves < 0) return std::isfinite(x.sum());
    side_[static_cast<size_t>(leaves)] = Side::kFree;
  }
  return false;
}

}  // namespace poise::balance
