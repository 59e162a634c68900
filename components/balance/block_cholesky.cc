#include "components/balance/block_cholesky.h"

#include <cmath>

namespace poise::balance {
namespace {

using Eigen::Index;
using Block = Eigen::Array<double, kBlock, 1>;

inline Block Load(const double* x) { return Eigen::Map<const Block>(x); }
inline void Store(const Block& value, double* x) { Eigen::Map<Block>{x} = value; }

/// The 4×4 block at `lower` (stride `stride`) to its factor, its inverse and its transpose.
bool FactorDiagonal(double* lower, Index stride, double* inverse) {
  double* const transposed = inverse + kBlock * kBlock;
  for (Index j = 0; j < kBlock; ++j) {
    double pivot = lower[j * stride + j];
    for (Index p = 0; p < j; ++p) pivot -= lower[p * stride + j] * lower[p * stride + j];
    if (!(pivot > 0 && pivot < HUGE_VAL)) return false;
    const double root = std::sqrt(pivot), reciprocal = 1 / root;
    lower[j * stride + j] = root;
    for (Index i = 0; i < j; ++i) lower[j * stride + i] = 0;
    for (Index i = j + 1; i < kBlock; ++i) {
      double value = lower[j * stride + i];
      for (Index p = 0; p < j; ++p) value -= lower[p * stride + i] * lower[p * stride + j];
      lower[j * stride + i] = value * reciprocal;
    }
    // Row j of the inverse.
    for (Index i = 0; i < kBlock; ++i) {
      double value = i == j ? 1 : 0;
      for (Index p = i; p < j; ++p) value -= lower[p * stride + j] * inverse[i * kBlock + p];
      inverse[i * kBlock + j] = i > j ? 0 : value * reciprocal;
      transposed[j * kBlock + i] = inverse[i * kBlock + j];
    }
  }
  return true;
}

}  // namespace

void AddColumnsOfBlocks(double sign, const BlockMatrix& a, Index cols, const double* x, double* y) {
  for (Index i = 0; i < a.rows; i += kBlock) {
    Block sum = Load(y + i);
    for (Index j = 0; j < cols; ++j) sum += Load(a.col(j) + i) * (sign * x[j]);
    Store(sum, y + i);
  }
}

void AddDotsOfBlocks(double sign, const BlockMatrix& a, Index cols, const double* x, double* y) {
  Index j = 0;
  for (; j + 2 <= cols; j += 2) {
    Block first = Block::Zero(), second = Block::Zero();
    for (Index i = 0; i < a.rows; i += kBlock) {
      const Block value = Load(x + i);
      first += Load(a.col(j) + i) * value;
      second += Load(a.col(j + 1) + i) * value;
    }
    y[j] += sign * first.sum();
    y[j + 1] += sign * second.sum();
  }
  for (; j < cols; ++j) {
    Block sum = Block::Zero();
    for (Index i = 0; i < a.rows; i += kBlock) sum += Load(a.col(j) + i) * Load(x + i);
    y[j] += sign * sum.sum();
  }
}

void SolveColumnsFromRight(const Eigen::Ref<const Eigen::MatrixXd>& lower, const BlockMatrix& a) {
  for (Index j = 0; j < lower.cols(); ++j) {
    const double reciprocal = 1 / lower(j, j);
    for (Index i = 0; i < a.rows; i += kBlock) {
      Block value = Load(a.col(j) + i);
      for (Index p = 0; p < j; ++p) value -= Load(a.col(p) + i) * lower(j, p);
      Store(value * reciprocal, a.col(j) + i);
    }
  }
}

bool FactorBlocks(const BlockMatrix& a, Index depth, double* inverses) {
  for (Index b = 0; b < a.rows; b += kBlock) {
    double* const first = a.col(depth + b);
    const auto column = [&](Index c) { return first + c * a.stride; };
    for (Index i = b; i < a.rows; i += kBlock) {
      Block c0 = Load(column(0) + i), c1 = Load(column(1) + i), c2 = Load(column(2) + i),
            c3 = Load(column(3) + i);
      for (Index p = 0; p < depth + b; ++p) {
        const double* const done = a.col(p);
        const Block value = Load(done + i);
        c0 -= value * done[b];
        c1 -= value * done[b + 1];
        c2 -= value * done[b + 2];
        c3 -= value * done[b + 3];
      }
      Store(c0, column(0) + i);
      Store(c1, column(1) + i);
      Store(c2, column(2) + i);
      Store(c3, column(3) + i);
    }
    double* const inverse = inverses + 8 * b;
    if (!FactorDiagonal(first + b, a.stride, inverse)) return false;
    for (Index i = b + kBlock; i < a.rows; i += kBlock) {
      // Times the inverse's transpose, last column first: each needs those before it.
      for (Index c = kBlock - 1; c >= 0; --c) {
        Block value = Load(column(c) + i) * inverse[c * kBlock + c];
        for (Index p = 0; p < c; ++p) value += Load(column(p) + i) * inverse[p * kBlock + c];
        Store(value, column(c) + i);
      }
    }
  }
  return true;
}

void SolveBlocks(const BlockMatrix& a, Index depth, const double* inverses, double* x) {
  for (Index b = 0; b < a.rows; b += kBlock) {
    const double* const inverse = inverses + 8 * b;
    Block solved = Load(inverse) * x[b];
    for (Index c = 1; c < kBlock; ++c) solved += Load(inverse + c * kBlock) * x[b + c];
    Store(solved, x + b);
    const double* const first = a.col(depth + b);
    for (Index i = b + kBlock; i < a.rows; i += kBlock) {
      Block rest = Load(x + i);
      for (Index c = 0; c < kBlock; ++c) rest -= Load(first + c * a.stride + i) * x[b + c];
      Store(rest, x + i);
    }
  }
}

void SolveBlocksTransposed(const BlockMatrix& a, Index depth, const double* inverses, double* x) {
  for (Index b = a.rows - kBlock; b >= 0; b -= kBlock) {
    const double* const first = a.col(depth + b);
    Block sums[kBlock] = {Block::Zero(), Block::Zero(), Block::Zero(), Block::Zero()};
    for (Index i = b + kBlock; i < a.rows; i += kBlock) {
      const Block value = Load(x + i);
      for (Index c = 0; c < kBlock; ++c) sums[c] += Load(first + c * a.stride + i) * value;
    }
    const double* const transposed = inverses + 8 * b + kBlock * kBlock;
    Block solved = Load(transposed) * (x[b] - sums[0].sum());
    for (Index c = 1; c < kBlock; ++c) {
      solved += Load(transposed + c * kBlock) * (x[b + c] - sums[c].sum());
    }
    Store(solved, x + b);
  }
}

}  // namespace poise::balance
