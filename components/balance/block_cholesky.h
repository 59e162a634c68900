// Products and a Cholesky factor of matrices of any size, in blocks of four rows: one register of
// x86-64-v3. Rows are filled up to a multiple of four, with zeros, so that no remainder is left.
// Products and sums are rounded one by one (no fused operation), in an order that depends on the
// sizes alone.
#pragma once

#include <Eigen/Core>

namespace poise::balance {

inline constexpr Eigen::Index kBlock = 4;

constexpr Eigen::Index WholeBlocks(Eigen::Index size) {
  return (size + kBlock - 1) / kBlock * kBlock;
}

/// Column-major matrix with `rows` a multiple of four and columns `stride` apart.
struct BlockMatrix {
  double* data = nullptr;
  Eigen::Index rows = 0, stride = 0;
  double* col(Eigen::Index j) const { return data + j * stride; }
};

/// y (rows) += sign · A x, over `cols` columns; `sign` 1 or −1.
void AddColumnsOfBlocks(double sign, const BlockMatrix& a, Eigen::Index cols, const double* x,
                        double* y);
inline void AddColumns(double sign, const BlockMatrix& a, Eigen::Index cols, const double* x,
                       double* y) {
  if (a.rows > 0) AddColumnsOfBlocks(sign, a, cols, x, y);
}
/// y (cols) += sign · Aᵀ x.
void AddDotsOfBlocks(double sign, const BlockMatrix& a, Eigen::Index cols, const double* x,
                     double* y);
inline void AddDots(double sign, const BlockMatrix& a, Eigen::Index cols, const double* x,
                    double* y) {
  if (a.rows > 0) AddDotsOfBlocks(sign, a, cols, x, y);
}

/// A ← A L⁻ᵀ over the columns of the lower triangular L.
void SolveColumnsFromRight(const Eigen::Ref<const Eigen::MatrixXd>& lower, const BlockMatrix& a);

/// Factor of A − B Bᵀ, in place. `a` has B in its first `depth` columns and the lower triangle of A
/// in the next `a.rows`, zeros above it; what it gets there is the factor L. `inverses`, 8·a.rows
/// doubles, gets the inverses of L's diagonal blocks and their transposes. Rows that fill up must
/// have a one on the diagonal. False when a pivot is not positive and finite.
bool FactorBlocks(const BlockMatrix& a, Eigen::Index depth, double* inverses);

/// x ← L⁻¹ x and x ← L⁻ᵀ x, with the `a`, `depth` and `inverses` of FactorBlocks.
void SolveBlocks(const BlockMatrix& a, Eigen::Index depth, const double* inverses, double* x);
void SolveBlocksTransposed(const BlockMatrix& a, Eigen::Index depth, const double* inverses,
                           double* x);

}  // namespace poise::balance
