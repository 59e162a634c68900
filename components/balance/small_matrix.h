// Kernels for matrices of a robot's size. Sizes known at compile time (the 12-joint biped) cost no
// call, no branch and no blocking; Eigen::Dynamic falls back on Eigen's own products. Neither
// allocates.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

#include "components/balance/block_cholesky.h"
#include "components/balance/contact_dynamics.h"

namespace poise::balance {

/// Scratch vector on the stack.
template <int Size>
using StackVector =
    Eigen::Matrix<double, Size, 1, 0, Size == Eigen::Dynamic ? kMaxJoints + 6 : Size, 1>;

/// The top left rows×cols of a column-major matrix, with the size known at compile time where it
/// can be.
template <int Rows, int Cols>
using MatrixView = Eigen::Map<Eigen::Matrix<double, Rows, Cols>, 0, Eigen::OuterStride<>>;
template <int Rows, int Cols>
using ConstMatrixView =
    Eigen::Map<const Eigen::Matrix<double, Rows, Cols>, 0, Eigen::OuterStride<>>;

template <int Rows, int Cols>
MatrixView<Rows, Cols> View(Eigen::MatrixXd& m, Eigen::Index rows, Eigen::Index cols,
                            Eigen::Index first_col = 0) {
  return MatrixView<Rows, Cols>(m.data() + first_col * m.outerStride(), rows, cols,
                                Eigen::OuterStride<>(m.outerStride()));
}
template <int Rows, int Cols, class Matrix>
ConstMatrixView<Rows, Cols> View(const Matrix& m, Eigen::Index rows, Eigen::Index cols,
                                 Eigen::Index first_col = 0) {
  return ConstMatrixView<Rows, Cols>(m.data() + first_col * m.outerStride(), rows, cols,
                                     Eigen::OuterStride<>(m.outerStride()));
}

/// dst ± a·b. With sizes known at compile time three columns of `dst` stay in registers; Eigen's
/// product otherwise.
template <int Sign, class Dst, class A, class B>
void AddProduct(Dst&& dst, const A& a, const B& b) {
  using Target = std::remove_reference_t<Dst>;
  if constexpr (Target::SizeAtCompileTime == Eigen::Dynamic ||
                A::SizeAtCompileTime == Eigen::Dynamic) {
    if constexpr (Sign > 0) {
      dst.noalias() += a * b;
    } else {
      dst.noalias() -= a * b;
    }
  } else {
    constexpr int kRows = Target::RowsAtCompileTime, kCols = Target::ColsAtCompileTime;
    constexpr int kDepth = A::ColsAtCompileTime;
    using Column = Eigen::Matrix<double, kRows, 1>;
    int j = 0;
    for (; j + 3 <= kCols; j += 3) {
      Column c0 = dst.col(j), c1 = dst.col(j + 1), c2 = dst.col(j + 2);
      for (int p = 0; p < kDepth; ++p) {
        const Column x = a.col(p) * double(Sign);
        c0 += x * b.coeff(p, j);
        c1 += x * b.coeff(p, j + 1);
        c2 += x * b.coeff(p, j + 2);
      }
      dst.col(j) = c0;
      dst.col(j + 1) = c1;
      dst.col(j + 2) = c2;
    }
    for (; j < kCols; ++j) {
      Column c = dst.col(j);
      for (int p = 0; p < kDepth; ++p) c += a.col(p) * (Sign * b.coeff(p, j));
      dst.col(j) = c;
    }
  }
}

/// dst = a·b.
template <class Dst, class A, class B>
void SetProduct(Dst&& dst, const A& a, const B& b) {
  dst.setZero();
  AddProduct<1>(dst, a, b);
}

/// Lower triangle of aᵀ·b, for a product that is symmetric.
template <class Dst, class A, class B>
void SetLowerProduct(Dst&& dst, const A& a, const B& b) {
  if constexpr (A::SizeAtCompileTime == Eigen::Dynamic) {
    dst.noalias() = a.transpose() * b;
  } else {
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      for (Eigen::Index i = j; i < b.cols(); ++i) dst.coeffRef(i, j) = a.col(i).dot(b.col(j));
    }
  }
}

/// Aᵀ x, into a vector.
template <class Dst, class A, class X>
void SetTransposedProduct(Dst&& dst, const A& a, const X& x) {
  if constexpr (A::SizeAtCompileTime == Eigen::Dynamic) {
    dst.noalias() = a.transpose() * x;
  } else {
    for (Eigen::Index i = 0; i < a.cols(); ++i) dst.coeffRef(i) = a.col(i).dot(x);
  }
}

// The factorisations below run over whole columns: at these sizes that is cheaper than columns of
// varying length. What stands above a diagonal is therefore kept zero.

/// Cholesky factor in place of the lower triangle, zeros above it. False when a pivot is not above
/// `tolerance` times its diagonal element or is not finite.
template <class Matrix>
bool Cholesky(Matrix&& m, double tolerance) {
  const Eigen::Index n = m.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    const double diagonal = m.coeff(j, j);
    StackVector<std::remove_reference_t<Matrix>::RowsAtCompileTime> column = m.col(j);
    for (Eigen::Index i = 0; i < j; ++i) column -= m.col(i) * m.coeff(j, i);
    const double pivot = column.coeff(j);
    if (!(pivot > tolerance * diagonal && pivot > 0 && pivot < HUGE_VAL)) return false;
    column *= 1 / std::sqrt(pivot);
    column.head(j).setZero();
    m.col(j) = column;
  }
  return true;
}

/// x ← L⁻¹ x.
template <class Factor, class Vector>
void SolveLower(const Factor& factor, Vector&& x) {
  const Eigen::Index n = factor.rows();
  StackVector<Factor::RowsAtCompileTime> rest = x;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double value = rest.coeff(j) / factor.coeff(j, j);
    rest -= factor.col(j) * value;
    x.coeffRef(j) = value;
  }
}

/// x ← L⁻ᵀ x.
template <class Factor, class Vector>
void SolveLowerTransposed(const Factor& factor, Vector&& x) {
  const Eigen::Index n = factor.rows();
  StackVector<Factor::RowsAtCompileTime> solved(n);
  solved.setZero();
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    solved.coeffRef(j) = (x.coeff(j) - factor.col(j).dot(solved)) / factor.coeff(j, j);
  }
  x = solved;
}

/// X ← X L⁻ᵀ.
template <class Factor, class Matrix>
void SolveFromRight(const Factor& factor, Matrix&& x) {
  const Eigen::Index n = factor.rows();
  for (Eigen::Index j = 0; j < n; ++j) {
    StackVector<std::remove_reference_t<Matrix>::RowsAtCompileTime> column = x.col(j);
    for (Eigen::Index i = 0; i < j; ++i) column -= x.col(i) * factor.coeff(j, i);
    x.col(j) = column * (1 / factor.coeff(j, j));
  }
}

/// Rank of W over the legs.
template <int S, bool Loop>
constexpr int Rank() {
  return S == Eigen::Dynamic ? Eigen::Dynamic : (Loop ? S - 6 : S);
}

/// Scratch over the joints beyond the legs, rows filled up to whole blocks.
using OthersVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, WholeBlocks(kMaxJoints), 1>;

/// A vector over the joints in the order of ReducedDynamics, or its reduced coordinates.
template <int S>
struct SplitVector {
  StackVector<S> legs;
  OthersVector others;  // zero in what fills up
};

/// Calls `function` with the legs' joints and the support as compile-time constants: two legs of
/// six joints, however many others there are, or any other number.
template <class Function>
decltype(auto) WithSizes(const ReducedDynamics& reduced, Function&& function) {
  if (reduced.num_legs == 12) {
    if (reduced.closed_loop()) return function.template operator()<12, true>();
    return function.template operator()<12, false>();
  }
  if (reduced.closed_loop()) return function.template operator()<Eigen::Dynamic, true>();
  return function.template operator()<Eigen::Dynamic, false>();
}

/// `joints` (in the robot's order) by legs and others.
template <int S>
void Gather(const ReducedDynamics& reduced, const double* joints, SplitVector<S>* split) {
  const Eigen::Index s = reduced.num_legs, o = reduced.num_others();
  const int* const order = reduced.order.data();
  split->legs.resize(s);
  split->others.resize(reduced.filled_others);
  for (Eigen::Index i = 0; i < s; ++i) split->legs.coeffRef(i) = joints[order[i]];
  for (Eigen::Index i = 0; i < o; ++i) split->others.coeffRef(i) = joints[order[s + i]];
  for (Eigen::Index i = o; i < reduced.filled_others; ++i) split->others.coeffRef(i) = 0;
}

/// The way back.
template <int S>
void Scatter(const ReducedDynamics& reduced, const SplitVector<S>& split, double* joints) {
  const Eigen::Index s = reduced.num_legs, o = reduced.num_others();
  const int* const order = reduced.order.data();
  for (Eigen::Index i = 0; i < s; ++i) joints[order[i]] = split.legs.coeff(i);
  for (Eigen::Index i = 0; i < o; ++i) joints[order[s + i]] = split.others.coeff(i);
}

/// [L_os L_oo] of the others; L_os in the first columns, as many as the legs' rank.
inline BlockMatrix OthersFactor(const ReducedDynamics& reduced) {
  return {const_cast<double*>(reduced.others_factor.data()), reduced.filled_others,
          reduced.others_factor.outerStride()};
}
inline BlockMatrix OthersCoupling(const ReducedDynamics& reduced) {
  return {const_cast<double*>(reduced.others_coupling.data()), reduced.filled_others,
          reduced.others_coupling.outerStride()};
}
inline BlockMatrix OthersCarried(const ReducedDynamics& reduced) {
  return {const_cast<double*>(reduced.others_carried.data()), reduced.filled_others,
          reduced.others_carried.outerStride()};
}

/// Base rows of A q̈ that joints make: Ψ q̈_j.
template <int S>
Vector6d BaseInertia(const ReducedDynamics& reduced, const SplitVector<S>& acceleration) {
  Vector6d result;
  SetTransposedProduct(result, View<S, 6>(reduced.psi_t, reduced.num_legs, 6), acceleration.legs);
  AddDots(1, OthersCoupling(reduced), 6, acceleration.others.data(), result.data());
  return result;
}

/// x ← L⁻¹ Vᵀ x: torque to reduced coordinates. `reduced_legs` gets the legs' part.
template <int S, bool Loop, class Legs>
void ToReduced(const ReducedDynamics& reduced, const StackVector<S>& legs, Legs* reduced_legs,
               OthersVector* others) {
  constexpr int R = Rank<S, Loop>();
  const Eigen::Index s = reduced.num_legs, r = reduced.legs_rank();
  if constexpr (Loop) {
    SetTransposedProduct(*reduced_legs, View<S, R>(reduced.rotation, s, r, 6), legs);
  } else {
    *reduced_legs = legs;
  }
  SolveLower(View<R, R>(reduced.factor, r, r), *reduced_legs);
  if (reduced.filled_others == 0) return;
  const BlockMatrix factor = OthersFactor(reduced);
  AddColumns(-1, factor, r, reduced_legs->data(), others->data());
  SolveBlocks(factor, r, reduced.others_inverses.data(), others->data());
}

/// x ← L⁻ᵀ x, in place: reduced coordinates to V's.
template <int S, bool Loop, class Legs>
void SolveReducedTransposed(const ReducedDynamics& reduced, Legs* legs, OthersVector* others) {
  constexpr int R = Rank<S, Loop>();
  const Eigen::Index r = reduced.legs_rank();
  if (reduced.filled_others > 0) {
    const BlockMatrix factor = OthersFactor(reduced);
    SolveBlocksTransposed(factor, r, reduced.others_inverses.data(), others->data());
    AddDots(-1, factor, r, others->data(), legs->data());
  }
  SolveLowerTransposed(View<R, R>(reduced.factor, r, r), *legs);
}

}  // namespace poise::balance
