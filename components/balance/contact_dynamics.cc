#include "components/balance/contact_dynamics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "components/balance/small_matrix.h"

namespace poise::balance {
namespace {

using Eigen::Dynamic;
using Eigen::Index;

// A loop whose smallest pivot is this far below its scale leaves no correct digit in Λ_c.
constexpr double kLoopTolerance = 1e-8;
// Base columns of J_c must be a rigid transform this closely, or its closed-form inverse would be
// wrong.
constexpr double kRigidTolerance = 1e-9;

template <int N>
constexpr int Plus6() {
  return N == Dynamic ? Dynamic : N + 6;
}

/// G = [C D; 0 C] with C orthonormal.
bool IsRigidTransform(const Eigen::Ref<const Matrix6d, 0, Eigen::OuterStride<>>& g) {
  const Eigen::Matrix3d c = g.topLeftCorner<3, 3>();
  const double error = (c.lazyProduct(c.transpose()) - Eigen::Matrix3d::Identity()).squaredNorm() +
                       (g.bottomRightCorner<3, 3>() - c).squaredNorm() +
                       g.bottomLeftCorner<3, 3>().squaredNorm();
  return error <= kRigidTolerance * kRigidTolerance && g.topRightCorner<3, 3>().allFinite();
}

/// G⁻ᵀ of a rigid transform: [C 0; −C Dᵀ C, C].
Matrix6d InverseTransposed(const Eigen::Ref<const Matrix6d, 0, Eigen::OuterStride<>>& g) {
  const Eigen::Matrix3d c = g.topLeftCorner<3, 3>();
  const Eigen::Matrix3d d = g.topRightCorner<3, 3>();
  Matrix6d inverse;
  inverse.topLeftCorner<3, 3>() = c;
  inverse.topRightCorner<3, 3>().setZero();
  inverse.bottomLeftCorner<3, 3>() = -(c * d.transpose() * c);
  inverse.bottomRightCorner<3, 3>() = c;
  return inverse;
}

/// Q and R of the k×6 matrix in `loop` by Householder reflections, I − U T Uᵀ. `loop` keeps R in
/// its upper triangle. False when the columns are dependent, seen against `scale` (of the terms
/// they are the sum of), or not finite.
template <int K>
bool Factorize(double scale, MatrixView<K, 6> loop, MatrixView<K, K> rotation) {
  const Index k = loop.rows();
  Eigen::Matrix<double, K, 6, 0, K == Dynamic ? kMaxJoints : K, 6> u(k, 6);
  Vector6d tau;
  double smallest = HUGE_VAL;
  u.setZero();
  for (Index j = 0; j < 6; ++j) {
    auto column = loop.col(j).tail(k - j);
    const double norm = column.norm();
    smallest = std::min(smallest, norm);
    if (!(norm > 0 && norm < HUGE_VAL)) return false;
    const double head = column(0);
    const double pivot = head >= 0 ? -norm : norm;
    const double scale = 1 / (head - pivot);
    tau(j) = (pivot - head) / pivot;
    u(j, j) = 1;
    u.col(j).tail(k - j - 1) = column.tail(k - j - 1) * scale;
    column(0) = pivot;
    for (Index i = j + 1; i < 6; ++i) {
      const double w = tau(j) * u.col(j).dot(loop.col(i));
      loop.col(i) -= u.col(j) * w;
    }
  }
  if (!(smallest > kLoopTolerance * scale)) return false;
  // The reflections' product: T upper triangular with T_jj = τ_j, T_·j = −τ_j T Uᵀ u_j.
  Matrix6d t = Matrix6d::Zero();
  for (Index j = 0; j < 6; ++j) {
    for (Index i = 0; i < j; ++i) {
      double sum = 0;
      for (Index l = i; l < j; ++l) sum += t(i, l) * u.col(l).dot(u.col(j));
      t(i, j) = -tau(j) * sum;
    }
    t(j, j) = tau(j);
  }
  Eigen::Matrix<double, K, 6, 0, K == Dynamic ? kMaxJoints : K, 6> ut(k, 6);
  SetProduct(ut, u, t);
  rotation.setIdentity();
  AddProduct<-1>(rotation, ut, u.transpose());
  return true;
}

/// Bias terms for generalised forces `force` (n×1) and contact bias γ (m×1).
template <int K, bool Loop>
void ReduceBias(const ReducedDynamics& reduced, const VectorRef& force,
                const VectorRef& contact_bias, ReducedDynamics::Bias* bias) {
  const Index k = reduced.num_joints;
  const auto phi_t = View<K, 6>(reduced.phi_t, k, 6);
  const auto psi_t = View<K, 6>(reduced.psi_t, k, 6);
  const Vector6d base_force = force.head<6>();
  const Vector6d a = -(reduced.root_transfer.transpose().lazyProduct(contact_bias.head<6>()));
  bias->base_acceleration = a;
  bias->base_wrench = -(reduced.base_mass.lazyProduct(a)) - base_force;
  Eigen::Map<StackVector<K>> torque(bias->joint_torque.data(), k);
  torque = Eigen::Map<const StackVector<K>>(force.data() + 6, k);
  AddProduct<1>(torque, phi_t, base_force);
  AddProduct<1>(torque, psi_t, a);
  if constexpr (Loop) {
    Vector6d gamma = contact_bias.segment<6>(6);
    gamma.noalias() += reduced.second_transfer.transpose().lazyProduct(a);
    // q̈_p = −Q₁ R⁻ᵀ γ
    const auto loop = View<6, 6>(reduced.loop, 6, 6);
    for (Index i = 0; i < 6; ++i) {
      for (Index j = 0; j < i; ++j) gamma(i) -= loop(j, i) * gamma(j);
      gamma(i) /= loop(i, i);
    }
    Eigen::Map<StackVector<K>> acceleration(bias->joint_acceleration.data(), k);
    acceleration.setZero();
    AddProduct<-1>(acceleration, View<K, 6>(reduced.rotation, k, 6), gamma);
    AddProduct<1>(torque, View<K, K>(reduced.mass, k, k), acceleration);
  } else {
    bias->joint_acceleration.setZero();
  }
}

/// Joint acceleration and contact wrenches (m×1; may be null) that `torque` produces.
template <int K, bool Loop>
void Respond(const ReducedDynamics& reduced, const ReducedDynamics::Bias& bias,
             const VectorRef& torque, double* wrench, StackVector<K>* joint_acceleration) {
  constexpr int R = Rank<K, Loop>();
  const Index k = reduced.num_joints, r = reduced.rank();
  eigen_assert(torque.size() == k);
  StackVector<K> net(k);
  net = Eigen::Map<const StackVector<K>>(torque.data(), k) -
        Eigen::Map<const StackVector<K>>(bias.joint_torque.data(), k);
  const auto factor = View<R, R>(reduced.factor, r, r);
  StackVector<R> z(r);
  StackVector<K>& acceleration = *joint_acceleration;
  acceleration.resize(k);
  if constexpr (Loop) {
    const auto basis = View<K, R>(reduced.rotation, k, r, 6);
    SetTransposedProduct(z, basis, net);
    SolveLower(factor, z);
    SolveLowerTransposed(factor, z);
    acceleration = Eigen::Map<const StackVector<K>>(bias.joint_acceleration.data(), k);
    AddProduct<1>(acceleration, basis, z);
  } else {
    z = net;
    SolveLower(factor, z);
    SolveLowerTransposed(factor, z);
    acceleration = z;
  }
  if (wrench == nullptr) return;
  Vector6d base_wrench = bias.base_wrench;
  Vector6d inertial;
  SetTransposedProduct(inertial, View<K, 6>(reduced.psi_t, k, 6), acceleration);
  base_wrench -= inertial;
  Eigen::Map<Vector6d> root(wrench);
  if constexpr (Loop) {
    // Hᵀ F_2 = Γ − h − M V z, with Hᵀ = Q₁ R.
    AddProduct<-1>(net, View<K, R>(reduced.mass_basis, k, r), z);
    Eigen::Map<Vector6d> second(wrench + 6);
    SetTransposedProduct(second, View<K, 6>(reduced.rotation, k, 6), net);
    const auto loop = View<6, 6>(reduced.loop, 6, 6);
    for (Index i = 5; i >= 0; --i) {
      for (Index j = i + 1; j < 6; ++j) second(i) -= loop(i, j) * second(j);
      second(i) /= loop(i, i);
    }
    base_wrench.noalias() -= reduced.second_transfer.lazyProduct(second);
  }
  root.noalias() = reduced.root_transfer.lazyProduct(base_wrench);
}

template <int K, bool Loop>
bool Reduce(const MatrixRef& mass_matrix, const MatrixRef& contact_jacobian,
            ReducedDynamics* reduced) {
  constexpr int R = Rank<K, Loop>();
  const Index k = reduced->num_joints, r = reduced->rank();
  const auto a = View<Plus6<K>(), Plus6<K>()>(mass_matrix, k + 6, k + 6);
  const auto jc = View < Loop ? 12 : 6, Plus6<K>() > (contact_jacobian, Loop ? 12 : 6, k + 6);

  const Eigen::Ref<const Matrix6d, 0, Eigen::OuterStride<>> root =
      jc.template topLeftCorner<6, 6>();
  if (!IsRigidTransform(root)) return false;
  reduced->root_transfer = InverseTransposed(root);
  reduced->base_mass = a.template topLeftCorner<6, 6>();

  using Slim = Eigen::Matrix<double, K, 6, 0, K == Dynamic ? kMaxJoints : K, 6>;
  auto phi_t = View<K, 6>(reduced->phi_t, k, 6);
  auto psi_t = View<K, 6>(reduced->psi_t, k, 6);
  auto mass = View<K, K>(reduced->mass, k, k);
  const Slim root_t = jc.template block<6, K>(0, 6, 6, k).transpose();
  phi_t.setZero();
  AddProduct<-1>(phi_t, root_t, reduced->root_transfer);
  const auto coupling = a.template block<K, 6>(6, 0, k, 6);
  psi_t = coupling;
  AddProduct<1>(psi_t, phi_t, reduced->base_mass);
  mass = a.template block<K, K>(6, 6, k, k);
  AddProduct<1>(mass, phi_t, psi_t.transpose());
  AddProduct<1>(mass, coupling, phi_t.transpose());

  auto factor = View<R, R>(reduced->factor, r, r);
  if constexpr (Loop) {
    const Eigen::Ref<const Matrix6d, 0, Eigen::OuterStride<>> second =
        jc.template block<6, 6>(6, 0);
    if (!IsRigidTransform(second)) return false;
    reduced->second_transfer = second.transpose();
    auto loop = View<K, 6>(reduced->loop, k, 6);
    loop = jc.template block<6, K>(6, 6, 6, k).transpose();
    const double scale = loop.norm();
    AddProduct<1>(loop, phi_t, reduced->second_transfer);
    if (!Factorize<K>(scale, loop, View<K, K>(reduced->rotation, k, k))) return false;
    const auto basis = View<K, R>(std::as_const(reduced->rotation), k, r, 6);
    auto mass_basis = View<K, R>(reduced->mass_basis, k, r);
    SetProduct(mass_basis, mass, basis);
    SetLowerProduct(factor, basis, mass_basis);
  } else {
    factor = mass;
  }
  return Cholesky(factor, 0.0);
}

}  // namespace

ContactDynamics::ContactDynamics(int num_joints) {
  if (num_joints < 1 || num_joints > kMaxJoints) {
    throw std::invalid_argument("ContactDynamics: joints must be between 1 and 128");
  }
  const Index k = num_joints;
  reduced_.num_joints = num_joints;
  for (auto* m : {&reduced_.phi_t, &reduced_.psi_t, &reduced_.loop})
    m->setZero(std::max<Index>(k, 6), 6);
  for (auto* m : {&reduced_.mass, &reduced_.rotation, &reduced_.mass_basis, &reduced_.factor}) {
    m->setZero(k, k);
  }
  for (auto* v :
       {&reduced_.bias.joint_torque, &reduced_.bias.joint_acceleration, &reduced_.gravity_torque}) {
    v->setZero(k);
  }
  contact_jacobian_.setZero(12, k + 6);
  for (auto* v : {&bias_, &gravity_, &force_}) v->setZero(k + 6);
  contact_bias_.setZero(12);
}

bool ContactDynamics::Compute(const MatrixRef& mass_matrix, const VectorRef& bias,
                              const VectorRef& gravity, const MatrixRef& contact_jacobian,
                              const VectorRef& contact_bias) {
  const Index k = reduced_.num_joints, n = k + 6, m = contact_jacobian.rows();
  if ((m != 6 && m != 12) || (m == 12 && k <= 6) || mass_matrix.rows() != n ||
      mass_matrix.cols() != n || bias.size() != n || gravity.size() != n ||
      contact_jacobian.cols() != n || contact_bias.size() != m) {
    return false;
  }
  reduced_.num_contact_rows = static_cast<int>(m);
  contact_jacobian_.topRows(m) = contact_jacobian;
  contact_bias_.head(m) = contact_bias;
  bias_ = bias;
  gravity_ = gravity;
  force_ = bias + gravity;
  return WithSizes(reduced_, [&]<int K, bool Loop>() {
    if (!Reduce<K, Loop>(mass_matrix, contact_jacobian, &reduced_)) return false;
    ReduceBias<K, Loop>(reduced_, force_, contact_bias, &reduced_.bias);
    Eigen::Map<StackVector<K>> held(reduced_.gravity_torque.data(), k);
    held = Eigen::Map<const StackVector<K>>(gravity.data() + 6, k);
    AddProduct<1>(held, View<K, 6>(std::as_const(reduced_.phi_t), k, 6),
                  Vector6d(gravity.head<6>()));
    const double sum =
        reduced_.bias.joint_torque.sum() + reduced_.bias.base_wrench.sum() + held.sum();
    return std::isfinite(sum);
  });
}

void ContactDynamics::ExpectedWrench(const VectorRef& torque,
                                     Eigen::Ref<Eigen::VectorXd> wrench) const {
  eigen_assert(wrench.size() == num_contact_rows());
  WithSizes(reduced_, [&]<int K, bool Loop>() {
    StackVector<K> acceleration;
    Respond<K, Loop>(reduced_, reduced_.bias, torque, wrench.data(), &acceleration);
  });
}

void ContactDynamics::Acceleration(const VectorRef& torque,
                                   Eigen::Ref<Eigen::VectorXd> acceleration) const {
  WithSizes(reduced_, [&]<int K, bool Loop>() {
    const Index k = reduced_.num_joints;
    StackVector<K> joints;
    Respond<K, Loop>(reduced_, reduced_.bias, torque, nullptr, &joints);
    Vector6d base;
    SetTransposedProduct(base, View<K, 6>(reduced_.phi_t, k, 6), joints);
    acceleration.template head<6>() = base + reduced_.bias.base_acceleration;
    acceleration.tail(k) = joints;
  });
}

void ContactDynamics::ReduceTorque(const VectorRef& torque,
                                   Eigen::Ref<Eigen::VectorXd> reduced) const {
  WithSizes(reduced_, [&]<int K, bool Loop>() {
    constexpr int R = Rank<K, Loop>();
    const Index k = reduced_.num_joints, r = reduced_.rank();
    eigen_assert(torque.size() == k && reduced.size() == r);
    const Eigen::Map<const StackVector<K>> command(torque.data(), k);
    Eigen::Map<StackVector<R>> result(reduced.data(), r);
    if constexpr (Loop) {
      SetTransposedProduct(result, View<K, R>(reduced_.rotation, k, r, 6), command);
    } else {
      result = command;
    }
    SolveLower(View<R, R>(reduced_.factor, r, r), result);
  });
}

void ContactDynamics::ExpandTorque(const VectorRef& reduced,
                                   Eigen::Ref<Eigen::VectorXd> torque) const {
  WithSizes(reduced_, [&]<int K, bool Loop>() {
    constexpr int R = Rank<K, Loop>();
    const Index k = reduced_.num_joints, r = reduced_.rank();
    eigen_assert(torque.size() == k && reduced.size() == r);
    const auto factor = View<R, R>(reduced_.factor, r, r);
    StackVector<R> z = StackVector<R>::Zero(r);
    for (Index j = 0; j < r; ++j) z += factor.col(j) * reduced(j);
    Eigen::Map<StackVector<K>> result(torque.data(), k);
    if constexpr (Loop) {
      SetProduct(result, View<K, R>(reduced_.rotation, k, r, 6), z);
    } else {
      result = z;
    }
  });
}

void ContactDynamics::ReduceRows(const MatrixRef& jacobian, const VectorRef& bias_acceleration,
                                 Eigen::Ref<Eigen::MatrixXd> rows_t,
                                 Eigen::Ref<Eigen::VectorXd> load) const {
  WithSizes(reduced_, [&]<int K, bool Loop>() {
    constexpr int R = Rank<K, Loop>();
    const Index k = reduced_.num_joints, r = reduced_.rank(), t = jacobian.rows();
    eigen_assert(jacobian.cols() == k + 6 && rows_t.rows() == r && rows_t.cols() == t &&
                 load.size() == t);
    const auto phi_t = View<K, 6>(reduced_.phi_t, k, 6);
    const auto factor = View<R, R>(reduced_.factor, r, r);
    const Eigen::Map<const StackVector<K>> bias_torque(reduced_.bias.joint_torque.data(), k);
    StackVector<R> bias(r);  // L⁻¹ Vᵀ h
    StackVector<K> joints(k);
    if constexpr (Loop) {
      SetTransposedProduct(bias, View<K, R>(reduced_.rotation, k, r, 6), bias_torque);
    } else {
      bias = bias_torque;
    }
    SolveLower(factor, bias);
    for (Index i = 0; i < t; ++i) {
      const Vector6d base = jacobian.block<1, 6>(i, 0).transpose();
      for (Index j = 0; j < k; ++j) joints(j) = jacobian(i, 6 + j);
      AddProduct<1>(joints, phi_t, base);
      Eigen::Map<StackVector<R>> row(&rows_t(0, i), r);
      double drift = bias_acceleration(i) + base.dot(reduced_.bias.base_acceleration);
      if constexpr (Loop) {
        SetTransposedProduct(row, View<K, R>(reduced_.rotation, k, r, 6), joints);
        drift += joints.dot(Eigen::Map<const StackVector<K>>(
            reduced_.bias.joint_acceleration.data(), k));
      } else {
        row = joints;
      }
      if (!(row.squaredNorm() > kHeld * kHeld * jacobian.row(i).squaredNorm())) row.setZero();
      SolveLower(factor, row);
      load(i) = row.dot(bias) - drift;
    }
  });
}

// The equations of motion are linear in forces, contact bias and torque: the paper's matrices are
// their unit responses.
Eigen::VectorXd ContactDynamics::Wrench(const VectorRef& generalized_force,
                                        const VectorRef& contact_bias,
                                        const VectorRef& torque) const {
  return WithSizes(reduced_, [&]<int K, bool Loop>() {
    ReducedDynamics::Bias bias = reduced_.bias;
    ReduceBias<K, Loop>(reduced_, generalized_force, contact_bias, &bias);
    Eigen::VectorXd wrench(num_contact_rows());
    StackVector<K> acceleration;
    Respond<K, Loop>(reduced_, bias, torque, wrench.data(), &acceleration);
    return wrench;
  });
}

Eigen::MatrixXd ContactDynamics::lambda_c() const {
  const Index k = num_joints(), m = num_contact_rows();
  const Eigen::VectorXd force = Eigen::VectorXd::Zero(k + 6), torque = Eigen::VectorXd::Zero(k);
  Eigen::MatrixXd result(m, m);
  for (Index i = 0; i < m; ++i) result.col(i) = Wrench(force, Eigen::VectorXd::Unit(m, i), torque);
  return result;
}

Eigen::VectorXd ContactDynamics::mu_c() const {
  return -Wrench(bias_, contact_bias_.head(num_contact_rows()),
                 Eigen::VectorXd::Zero(num_joints()));
}

Eigen::VectorXd ContactDynamics::p_c() const {
  return -Wrench(gravity_, Eigen::VectorXd::Zero(num_contact_rows()),
                 Eigen::VectorXd::Zero(num_joints()));
}

Eigen::MatrixXd ContactDynamics::jc_bar_transpose() const {
  const Index k = num_joints(), m = num_contact_rows();
  const Eigen::VectorXd bias = Eigen::VectorXd::Zero(m), torque = Eigen::VectorXd::Zero(k);
  Eigen::MatrixXd result(m, k + 6);
  for (Index i = 0; i < k + 6; ++i)
    result.col(i) = -Wrench(Eigen::VectorXd::Unit(k + 6, i), bias, torque);
  return result;
}

Eigen::MatrixXd ContactDynamics::w() const {
  const Index k = num_joints(), r = reduced_.rank();
  Eigen::MatrixXd half = reduced_.closed_loop()
                             ? Eigen::MatrixXd(reduced_.rotation.rightCols(r).transpose())
                             : Eigen::MatrixXd::Identity(k, k);
  reduced_.factor.topLeftCorner(r, r).triangularView<Eigen::Lower>().solveInPlace(half);
  return half.transpose() * half;
}

Eigen::MatrixXd ContactDynamics::w_pinv() const {
  if (!reduced_.closed_loop()) return reduced_.mass;
  const auto basis = reduced_.rotation.rightCols(reduced_.rank());
  const Eigen::MatrixXd projector = basis * basis.transpose();
  return projector * reduced_.mass * projector;
}

}  // namespace poise::balance
