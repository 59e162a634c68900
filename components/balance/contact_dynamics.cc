#include "components/balance/contact_dynamics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
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

/// The joints in [first, first + count) of the order follow one another, as most robots' legs do.
bool AreNeighbours(const ReducedDynamics& reduced, Index first, Index count) {
  const int* const order = reduced.order.data() + first;
  return count == 0 || order[count - 1] - order[0] == count - 1;
}

/// Bias terms for generalised forces `force` (n×1) and contact bias γ (m×1).
template <int S, bool Loop>
void ReduceBias(const ReducedDynamics& reduced, const VectorRef& force,
                const VectorRef& contact_bias, ReducedDynamics::Bias* bias) {
  const Index s = reduced.num_legs;
  const auto phi_t = View<S, 6>(reduced.phi_t, s, 6);
  const auto psi_t = View<S, 6>(reduced.psi_t, s, 6);
  const Vector6d base_force = force.head<6>();
  const Vector6d a = -(reduced.root_transfer.transpose().lazyProduct(contact_bias.head<6>()));
  bias->base_acceleration = a;
  bias->base_wrench = -(reduced.base_mass.lazyProduct(a)) - base_force;
  SplitVector<S> torque;
  Gather(reduced, force.data() + 6, &torque);
  AddProduct<1>(torque.legs, phi_t, base_force);
  AddProduct<1>(torque.legs, psi_t, a);
  AddColumns(1, OthersCoupling(reduced), 6, a.data(), torque.others.data());
  Eigen::Map<StackVector<S>> acceleration(bias->joint_acceleration.data(), s);
  acceleration.setZero();
  if constexpr (Loop) {
    Vector6d gamma = contact_bias.segment<6>(6);
    gamma.noalias() += reduced.second_transfer.transpose().lazyProduct(a);
    // q̈_p = −Q₁ R⁻ᵀ γ
    const auto loop = View<6, 6>(reduced.loop, 6, 6);
    for (Index i = 0; i < 6; ++i) {
      for (Index j = 0; j < i; ++j) gamma(i) -= loop(j, i) * gamma(j);
      gamma(i) /= loop(i, i);
    }
    AddProduct<-1>(acceleration, View<S, 6>(reduced.rotation, s, 6), gamma);
    AddProduct<1>(torque.legs, View<S, S>(reduced.mass, s, s), acceleration);
    if (reduced.filled_others > 0) {
      // M_os = A_os + A_ob Φ
      Vector6d base;
      SetTransposedProduct(base, phi_t, acceleration);
      AddColumns(1, OthersCoupling(reduced), 6, base.data(), torque.others.data());
      if (reduced.legs_carry_others()) {
        AddColumns(1, OthersCarried(reduced), s, acceleration.data(), torque.others.data());
      }
    }
  }
  bias->joint_torque = torque.legs;
  bias->others_torque = torque.others;
}

/// Γ − h.
template <int S>
void NetTorque(const ReducedDynamics& reduced, const ReducedDynamics::Bias& bias,
               const VectorRef& torque, SplitVector<S>* net) {
  Gather(reduced, torque.data(), net);
  net->legs -= Eigen::Map<const StackVector<S>>(bias.joint_torque.data(), reduced.num_legs);
  net->others -= bias.others_torque;
}

/// Joint acceleration and contact wrenches (m×1; may be null) that `torque` produces.
template <int S, bool Loop>
void Respond(const ReducedDynamics& reduced, const ReducedDynamics::Bias& bias,
             const VectorRef& torque, double* wrench, SplitVector<S>* joint_acceleration) {
  constexpr int R = Rank<S, Loop>();
  const Index s = reduced.num_legs, r = reduced.legs_rank();
  eigen_assert(torque.size() == reduced.num_joints);
  SplitVector<S> net;
  NetTorque(reduced, bias, torque, &net);
  StackVector<R> z(r);
  SplitVector<S>& acceleration = *joint_acceleration;
  acceleration.others = net.others;
  ToReduced<S, Loop>(reduced, net.legs, &z, &acceleration.others);
  SolveReducedTransposed<S, Loop>(reduced, &z, &acceleration.others);
  if constexpr (Loop) {
    acceleration.legs = Eigen::Map<const StackVector<S>>(bias.joint_acceleration.data(), s);
    AddProduct<1>(acceleration.legs, View<S, R>(reduced.rotation, s, r, 6), z);
  } else {
    acceleration.legs = z;
  }
  if (wrench == nullptr) return;
  Vector6d base_wrench = bias.base_wrench;
  const Vector6d inertial = BaseInertia(reduced, acceleration);
  base_wrench -= inertial;
  Eigen::Map<Vector6d> root(wrench);
  if constexpr (Loop) {
    // Hᵀ F_2 = Γ − h − M V z, with Hᵀ = Q₁ R.
    AddProduct<-1>(net.legs, View<S, R>(reduced.mass_basis, s, r), z);
    if (reduced.filled_others > 0) {
      Vector6d base = Vector6d::Zero();
      AddDots(1, OthersCoupling(reduced), 6, acceleration.others.data(), base.data());
      AddProduct<-1>(net.legs, View<S, 6>(reduced.phi_t, s, 6), base);
      if (reduced.legs_carry_others()) {
        AddDots(-1, OthersCarried(reduced), s, acceleration.others.data(), net.legs.data());
      }
    }
    Eigen::Map<Vector6d> second(wrench + 6);
    SetTransposedProduct(second, View<S, 6>(reduced.rotation, s, 6), net.legs);
    const auto loop = View<6, 6>(reduced.loop, 6, 6);
    for (Index i = 5; i >= 0; --i) {
      for (Index j = i + 1; j < 6; ++j) second(i) -= loop(i, j) * second(j);
      second(i) /= loop(i, i);
    }
    base_wrench.noalias() -= reduced.second_transfer.lazyProduct(second);
  }
  root.noalias() = reduced.root_transfer.lazyProduct(base_wrench);
}

/// What the others add: A_ob, and L's rows. False when a pivot is not positive.
template <int S, bool Loop>
bool ReduceOthers(const MatrixRef& mass_matrix, ReducedDynamics* reduced) {
  constexpr int R = Rank<S, Loop>();
  const Index s = reduced->num_legs, o = reduced->num_others(), r = reduced->legs_rank();
  const Index n = mass_matrix.outerStride();
  const int* const legs = reduced->order.data();
  const int* const others = legs + s;
  const double* const a = mass_matrix.data();
  const auto entry = [&](Index row, Index column) { return a[column * n + row]; };
  auto& coupling = reduced->others_coupling;
  for (Index j = 0; j < 6; ++j) {
    for (Index i = 0; i < o; ++i) coupling(i, j) = entry(6 + others[i], j);
  }
  // M_os V = A_os V + A_ob (Φ V)
  const BlockMatrix factor = OthersFactor(*reduced);
  const auto phi_t = View<S, 6>(std::as_const(reduced->phi_t), s, 6);
  if (reduced->legs_carry_others()) {
    for (Index j = 0; j < s; ++j) {
      for (Index i = 0; i < o; ++i) {
        reduced->others_carried(i, j) = entry(6 + others[i], 6 + legs[j]);
      }
    }
  }
  for (Index j = 0; j < r; ++j) {
    Vector6d base;
    StackVector<S> column(s);
    if constexpr (Loop) {
      column = View<S, R>(std::as_const(reduced->rotation), s, r, 6).col(j);
      SetTransposedProduct(base, phi_t, column);
    } else {
      column = StackVector<S>::Unit(s, j);
      base = phi_t.row(j).transpose();
    }
    double* const out = factor.col(j);
    std::fill_n(out, reduced->filled_others, 0.0);
    AddColumns(1, OthersCoupling(*reduced), 6, base.data(), out);
    if (reduced->legs_carry_others()) {
      AddColumns(1, OthersCarried(*reduced), s, column.data(), out);
    }
  }
  SolveColumnsFromRight(reduced->factor.topLeftCorner(r, r), factor);
  for (Index j = 0; j < o; ++j) {
    double* const out = factor.col(r + j);
    std::fill_n(out, j, 0.0);
    for (Index i = j; i < o; ++i) out[i] = entry(6 + others[i], 6 + others[j]);
    std::fill(out + o, out + reduced->filled_others, 0.0);
  }
  for (Index j = o; j < reduced->filled_others; ++j) {
    std::fill_n(factor.col(r + j), reduced->filled_others, 0.0);
    factor.col(r + j)[j] = 1;
  }
  return FactorBlocks(factor, r, reduced->others_inverses.data());
}

template <int S, bool Loop>
bool Reduce(const MatrixRef& mass_matrix, const MatrixRef& contact_jacobian,
            ReducedDynamics* reduced) {
  constexpr int R = Rank<S, Loop>(), kRows = Loop ? 12 : 6;
  const Index s = reduced->num_legs, r = reduced->legs_rank();

  const Eigen::Ref<const Matrix6d, 0, Eigen::OuterStride<>> root =
      contact_jacobian.topLeftCorner<6, 6>();
  if (!IsRigidTransform(root)) return false;
  reduced->root_transfer = InverseTransposed(root);
  reduced->base_mass = mass_matrix.topLeftCorner<6, 6>();

  using Slim = Eigen::Matrix<double, S, 6, 0, S == Dynamic ? kMaxJoints : S, 6>;
  auto phi_t = View<S, 6>(reduced->phi_t, s, 6);
  auto psi_t = View<S, 6>(reduced->psi_t, s, 6);
  auto mass = View<S, S>(reduced->mass, s, s);
  // The legs' columns of J_c and rows of A_jb: where they are, if neighbours, else gathered.
  Eigen::Matrix<double, kRows, S, 0, kRows, S == Dynamic ? kMaxJoints : S> gathered_joints;
  Slim gathered_coupling;
  const int* const order = reduced->order.data();
  const Index first = 6 + order[0];
  const double* joints_data = contact_jacobian.data() + first * contact_jacobian.outerStride();
  const double* coupling_data = mass_matrix.data() + first;
  Index joints_stride = contact_jacobian.outerStride(), coupling_stride = mass_matrix.outerStride();
  if (AreNeighbours(*reduced, 0, s)) {
    mass = mass_matrix.block<S, S>(first, first, s, s);
  } else {
    gathered_joints.resize(kRows, s);
    gathered_coupling.resize(s, 6);
    for (Index j = 0; j < s; ++j) {
      gathered_joints.col(j) = contact_jacobian.col(6 + order[j]);
      gathered_coupling.row(j) = mass_matrix.block<1, 6>(6 + order[j], 0);
      for (Index i = 0; i < s; ++i) mass(i, j) = mass_matrix(6 + order[i], 6 + order[j]);
    }
    joints_data = gathered_joints.data();
    joints_stride = kRows;
    coupling_data = gathered_coupling.data();
    coupling_stride = gathered_coupling.outerStride();
  }
  const ConstMatrixView<kRows, S> joints(joints_data, kRows, s,
                                         Eigen::OuterStride<>(joints_stride));
  const ConstMatrixView<S, 6> coupling(coupling_data, s, 6, Eigen::OuterStride<>(coupling_stride));
  const Slim root_t = joints.template topRows<6>().transpose();
  phi_t.setZero();
  AddProduct<-1>(phi_t, root_t, reduced->root_transfer);
  psi_t = coupling;
  AddProduct<1>(psi_t, phi_t, reduced->base_mass);
  AddProduct<1>(mass, phi_t, psi_t.transpose());
  AddProduct<1>(mass, coupling, phi_t.transpose());

  auto factor = View<R, R>(reduced->factor, r, r);
  if constexpr (Loop) {
    const Eigen::Ref<const Matrix6d, 0, Eigen::OuterStride<>> second =
        contact_jacobian.block<6, 6>(6, 0);
    if (!IsRigidTransform(second)) return false;
    reduced->second_transfer = second.transpose();
    auto loop = View<S, 6>(reduced->loop, s, 6);
    loop = joints.template bottomRows<6>().transpose();
    const double scale = loop.norm();
    AddProduct<1>(loop, phi_t, reduced->second_transfer);
    if (!Factorize<S>(scale, loop, View<S, S>(reduced->rotation, s, s))) return false;
    const auto basis = View<S, R>(std::as_const(reduced->rotation), s, r, 6);
    auto mass_basis = View<S, R>(reduced->mass_basis, s, r);
    SetProduct(mass_basis, mass, basis);
    SetLowerProduct(factor, basis, mass_basis);
  } else {
    factor = mass;
  }
  if (!Cholesky(factor, 0.0)) return false;
  return reduced->filled_others == 0 || ReduceOthers<S, Loop>(mass_matrix, reduced);
}

std::vector<int> AllJoints(int num_joints) {
  std::vector<int> joints(static_cast<size_t>(std::max(0, num_joints)));
  std::iota(joints.begin(), joints.end(), 0);
  return joints;
}

}  // namespace

ContactDynamics::ContactDynamics(int num_joints)
    : ContactDynamics(num_joints, AllJoints(num_joints), false) {}

ContactDynamics::ContactDynamics(int num_joints, std::span<const int> legs,
                                 bool legs_carry_others) {
  if (num_joints < 1 || num_joints > kMaxJoints) {
    throw std::invalid_argument("ContactDynamics: joints must be between 1 and 128");
  }
  if (legs.empty() || !std::is_sorted(legs.begin(), legs.end()) || legs.front() < 0 ||
      legs.back() >= num_joints || std::ranges::adjacent_find(legs) != legs.end()) {
    throw std::invalid_argument("ContactDynamics: legs must be joints, ascending");
  }
  const Index k = num_joints, s = static_cast<Index>(legs.size());
  const Index filled = WholeBlocks(k - s);
  reduced_.num_joints = num_joints;
  reduced_.num_legs = static_cast<int>(s);
  reduced_.filled_others = static_cast<int>(filled);
  reduced_.order.assign(legs.begin(), legs.end());
  for (const int joint : AllJoints(num_joints)) {
    if (!std::binary_search(legs.begin(), legs.end(), joint)) reduced_.order.push_back(joint);
  }
  for (auto* m : {&reduced_.phi_t, &reduced_.psi_t, &reduced_.loop})
    m->setZero(std::max<Index>(s, 6), 6);
  for (auto* m : {&reduced_.mass, &reduced_.rotation, &reduced_.mass_basis, &reduced_.factor}) {
    m->setZero(s, s);
  }
  reduced_.others_coupling.setZero(filled, 6);
  reduced_.others_carried.setZero(legs_carry_others ? filled : 0, s);
  reduced_.others_factor.setZero(filled, filled + s);
  reduced_.others_inverses.setZero(8 * filled);
  reduced_.bias.joint_torque.setZero(s);
  reduced_.bias.joint_acceleration.setZero(s);
  reduced_.bias.others_torque.setZero(filled);
  reduced_.gravity_torque.setZero(k);
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
  return WithSizes(reduced_, [&]<int S, bool Loop>() {
    if (!Reduce<S, Loop>(mass_matrix, contact_jacobian, &reduced_)) return false;
    ReduceBias<S, Loop>(reduced_, force_, contact_bias, &reduced_.bias);
    SplitVector<S> held;
    Gather(reduced_, gravity.data() + 6, &held);
    AddProduct<1>(held.legs, View<S, 6>(std::as_const(reduced_.phi_t), reduced_.num_legs, 6),
                  Vector6d(gravity.head<6>()));
    Scatter(reduced_, held, reduced_.gravity_torque.data());
    const double sum = reduced_.bias.joint_torque.sum() + reduced_.bias.others_torque.sum() +
                       reduced_.bias.base_wrench.sum() + reduced_.gravity_torque.sum();
    return std::isfinite(sum);
  });
}

void ContactDynamics::ExpectedWrench(const VectorRef& torque,
                                     Eigen::Ref<Eigen::VectorXd> wrench) const {
  eigen_assert(wrench.size() == num_contact_rows());
  WithSizes(reduced_, [&]<int S, bool Loop>() {
    SplitVector<S> acceleration;
    Respond<S, Loop>(reduced_, reduced_.bias, torque, wrench.data(), &acceleration);
  });
}

void ContactDynamics::Acceleration(const VectorRef& torque,
                                   Eigen::Ref<Eigen::VectorXd> acceleration) const {
  WithSizes(reduced_, [&]<int S, bool Loop>() {
    SplitVector<S> joints;
    Respond<S, Loop>(reduced_, reduced_.bias, torque, nullptr, &joints);
    Vector6d base;
    SetTransposedProduct(base, View<S, 6>(reduced_.phi_t, reduced_.num_legs, 6), joints.legs);
    acceleration.template head<6>() = base + reduced_.bias.base_acceleration;
    Scatter(reduced_, joints, acceleration.data() + 6);
  });
}

void ContactDynamics::ReduceTorque(const VectorRef& torque,
                                   Eigen::Ref<Eigen::VectorXd> reduced) const {
  WithSizes(reduced_, [&]<int S, bool Loop>() {
    const Index r = reduced_.legs_rank();
    eigen_assert(torque.size() == reduced_.num_joints && reduced.size() == reduced_.rank());
    SplitVector<S> command;
    Gather(reduced_, torque.data(), &command);
    StackVector<Rank<S, Loop>()> legs(r);
    ToReduced<S, Loop>(reduced_, command.legs, &legs, &command.others);
    reduced.head(r) = legs;
    reduced.tail(reduced_.num_others()) = command.others.head(reduced_.num_others());
  });
}

void ContactDynamics::ExpandTorque(const VectorRef& reduced,
                                   Eigen::Ref<Eigen::VectorXd> torque) const {
  WithSizes(reduced_, [&]<int S, bool Loop>() {
    constexpr int R = Rank<S, Loop>();
    const Index s = reduced_.num_legs, r = reduced_.legs_rank(), o = reduced_.num_others();
    eigen_assert(torque.size() == reduced_.num_joints && reduced.size() == reduced_.rank());
    const auto factor = View<R, R>(reduced_.factor, r, r);
    StackVector<R> z = StackVector<R>::Zero(r);
    for (Index j = 0; j < r; ++j) z += factor.col(j) * reduced(j);
    SplitVector<S> result;
    result.others.setZero(reduced_.filled_others);
    AddColumns(1, OthersFactor(reduced_), r + o, reduced.data(), result.others.data());
    result.legs.resize(s);
    if constexpr (Loop) {
      SetProduct(result.legs, View<S, R>(reduced_.rotation, s, r, 6), z);
    } else {
      result.legs = z;
    }
    Scatter(reduced_, result, torque.data());
  });
}

void ContactDynamics::HoldOthers(const VectorRef& joint_acceleration,
                                 Eigen::Ref<Eigen::VectorXd> reduced) const {
  WithSizes(reduced_, [&]<int S, bool Loop>() {
    const Index r = reduced_.legs_rank(), o = reduced_.num_others();
    eigen_assert(joint_acceleration.size() == reduced_.num_joints &&
                 reduced.size() == reduced_.rank());
    StackVector<Rank<S, Loop>()> bias(r);  // L⁻¹ Vᵀ h
    OthersVector others = reduced_.bias.others_torque;
    ToReduced<S, Loop>(reduced_,
                       StackVector<S>(Eigen::Map<const StackVector<S>>(
                           reduced_.bias.joint_torque.data(), reduced_.num_legs)),
                       &bias, &others);
    SplitVector<S> wanted;
    Gather(reduced_, joint_acceleration.data(), &wanted);
    const BlockMatrix factor = OthersFactor(reduced_);
    AddDots(1, {factor.col(r), factor.rows, factor.stride}, o, wanted.others.data(), others.data());
    reduced.head(r).setZero();
    reduced.tail(o) = others.head(o);
  });
}

void ContactDynamics::ReduceRows(const MatrixRef& jacobian, const VectorRef& bias_acceleration,
                                 Eigen::Ref<Eigen::MatrixXd> rows_t,
                                 Eigen::Ref<Eigen::VectorXd> load) const {
  WithSizes(reduced_, [&]<int S, bool Loop>() {
    constexpr int R = Rank<S, Loop>();
    const Index s = reduced_.num_legs, r = reduced_.legs_rank(), t = jacobian.rows();
    const Index o = reduced_.num_others();
    eigen_assert(jacobian.cols() == reduced_.num_joints + 6 && rows_t.cols() == t &&
                 rows_t.rows() == reduced_.rank() && load.size() == t);
    const auto phi_t = View<S, 6>(reduced_.phi_t, s, 6);
    StackVector<R> bias(r), row(r);  // L⁻¹ Vᵀ h
    OthersVector others_bias = reduced_.bias.others_torque;
    ToReduced<S, Loop>(
        reduced_,
        StackVector<S>(Eigen::Map<const StackVector<S>>(reduced_.bias.joint_torque.data(), s)),
        &bias, &others_bias);
    StackVector<Dynamic> given(reduced_.num_joints);
    SplitVector<S> joints;
    for (Index i = 0; i < t; ++i) {
      const Vector6d base = jacobian.block<1, 6>(i, 0).transpose();
      given = jacobian.row(i).tail(reduced_.num_joints).transpose();
      Gather(reduced_, given.data(), &joints);
      AddProduct<1>(joints.legs, phi_t, base);
      double drift = bias_acceleration(i) + base.dot(reduced_.bias.base_acceleration);
      drift += joints.legs.dot(
          Eigen::Map<const StackVector<S>>(reduced_.bias.joint_acceleration.data(), s));
      double left = joints.others.squaredNorm();
      if constexpr (Loop) {
        SetTransposedProduct(row, View<S, R>(reduced_.rotation, s, r, 6), joints.legs);
        left += row.squaredNorm();
      } else {
        left += joints.legs.squaredNorm();
      }
      ToReduced<S, Loop>(reduced_, joints.legs, &row, &joints.others);
      rows_t.col(i).head(r) = row;
      rows_t.col(i).tail(o) = joints.others.head(o);
      if (!(left > kHeld * kHeld * jacobian.row(i).squaredNorm())) {
        rows_t.col(i).setZero();
        row.setZero();
        joints.others.setZero();
      }
      load(i) = row.dot(bias) + joints.others.dot(others_bias) - drift;
    }
  });
}

// The equations of motion are linear in forces, contact bias and torque: the paper's matrices are
// their unit responses.
Eigen::VectorXd ContactDynamics::Wrench(const VectorRef& generalized_force,
                                        const VectorRef& contact_bias,
                                        const VectorRef& torque) const {
  return WithSizes(reduced_, [&]<int S, bool Loop>() {
    ReducedDynamics::Bias bias = reduced_.bias;
    ReduceBias<S, Loop>(reduced_, generalized_force, contact_bias, &bias);
    Eigen::VectorXd wrench(num_contact_rows());
    SplitVector<S> acceleration;
    Respond<S, Loop>(reduced_, bias, torque, wrench.data(), &acceleration);
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
  // Columns of the identity to reduced coordinates.
  const Index k = num_joints();
  Eigen::MatrixXd half(reduced_.rank(), k);
  for (Index i = 0; i < k; ++i) ReduceTorque(Eigen::VectorXd::Unit(k, i), half.col(i));
  return half.transpose() * half;
}

Eigen::MatrixXd ContactDynamics::w_pinv() const {
  // V Vᵀ M V Vᵀ = (V L)(V L)ᵀ
  const Index r = reduced_.rank();
  Eigen::MatrixXd root(num_joints(), r);
  for (Index i = 0; i < r; ++i) ExpandTorque(Eigen::VectorXd::Unit(r, i), root.col(i));
  return root * root.transpose();
}

}  // namespace poise::balance
