#include "components/balance/task_dynamics.h"

#include <stdexcept>
#include <utility>

#include "components/balance/small_matrix.h"

namespace poise::balance {
namespace {

using Eigen::Dynamic;
using Eigen::Index;

// Smallest share of a task's inverse inertia that the tasks before it may leave (sin² of the angle
// between them).
constexpr double kDependence = 1e-12;

/// Calls `function` with joints, support and task rows as compile-time constants where they are
/// common.
template <class Function>
decltype(auto) WithTaskSizes(const ReducedDynamics& reduced, Index rows, Function&& function) {
  if (reduced.num_joints == 12) {
    if (reduced.closed_loop()) {
      if (rows == 6) return function.template operator()<12, true, 6>();
      if (rows == 1) return function.template operator()<12, true, 1>();
    } else {
      if (rows == 12) return function.template operator()<12, false, 12>();
      if (rows == 1) return function.template operator()<12, false, 1>();
    }
  }
  if (reduced.closed_loop()) return function.template operator()<Dynamic, true, Dynamic>();
  return function.template operator()<Dynamic, false, Dynamic>();
}

/// x ← V Vᵀ x: the part of a torque that moves the robot.
template <int K, bool Loop, class Vector>
void RemoveInternalLoad(const ReducedDynamics& reduced, Vector* x) {
  if constexpr (Loop) {
    // I − Q₁ Q₁ᵀ
    const auto internal = View<K, 6>(reduced.rotation, reduced.num_joints, 6);
    Vector6d load;
    SetTransposedProduct(load, internal, *x);
    AddProduct<-1>(*x, internal, load);
  }
}

}  // namespace

TaskDynamics::TaskDynamics(int num_joints, int max_task_rows) {
  if (num_joints < 1 || num_joints > kMaxJoints || max_task_rows < 1 ||
      max_task_rows > num_joints) {
    throw std::invalid_argument("TaskDynamics: 1 to 128 joints, 1 to that many task rows");
  }
  joint_jacobian_.setZero(max_task_rows, num_joints);
  reduced_jacobian_.setZero(max_task_rows, num_joints);
  factor_.setZero(max_task_rows, max_task_rows);
  drift_.setZero(max_task_rows);
  load_.setZero(max_task_rows);
}

bool TaskDynamics::Compute(const ContactDynamics& contact, const MatrixRef& jacobian,
                           const VectorRef& bias_acceleration) {
  const ReducedDynamics& reduced = contact.reduced();
  const Index k = reduced.num_joints, t = jacobian.rows(), r = reduced.rank();
  if (t < 1 || t > factor_.rows() || t > r || k != joint_jacobian_.cols() ||
      jacobian.cols() != k + 6 || bias_acceleration.size() != t) {
    return false;
  }
  contact_ = &contact;
  rows_ = static_cast<int>(t);
  rank_ = static_cast<int>(r);
  return WithTaskSizes(reduced, t, [&]<int K, bool Loop, int T>() {
    constexpr int R = Rank<K, Loop>();
    const auto whole = View < T, K == Dynamic ? Dynamic : K + 6 > (jacobian, t, k + 6);
    const auto base = View<T, 6>(jacobian, t, 6);
    const auto joints = View<T, K>(jacobian, t, k, 6);
    auto joint_jacobian = View<T, K>(joint_jacobian_, t, k);
    joint_jacobian = joints;
    AddProduct<1>(joint_jacobian, base, View<K, 6>(reduced.phi_t, k, 6).transpose());

    Eigen::Map<StackVector<T>> drift(drift_.data(), t), load(load_.data(), t);
    drift = Eigen::Map<const StackVector<T>>(bias_acceleration.data(), t);
    AddProduct<1>(drift, base, reduced.bias.base_acceleration);

    auto reduced_jacobian = View<T, R>(reduced_jacobian_, t, r);
    StackVector<R> torque(r);  // L⁻¹ Vᵀ h
    const Eigen::Map<const StackVector<K>> bias_torque(reduced.bias.joint_torque.data(), k);
    if constexpr (Loop) {
      const auto basis = View<K, R>(reduced.rotation, k, r, 6);
      SetProduct(reduced_jacobian, joint_jacobian, basis);
      SetTransposedProduct(torque, basis, bias_torque);
      AddProduct<1>(drift, joint_jacobian,
                    Eigen::Map<const StackVector<K>>(reduced.bias.joint_acceleration.data(), k));
    } else {
      reduced_jacobian = joint_jacobian;
      torque = bias_torque;
    }
    StackVector<T> asked(t), left(t);
    asked.setZero();
    left.setZero();
    for (Index j = 0; j < k + 6; ++j) asked += whole.col(j).cwiseAbs2();
    for (Index j = 0; j < r; ++j) left += reduced_jacobian.col(j).cwiseAbs2();
    if (!((left - asked * (kHeld * kHeld)).minCoeff() > 0)) return false;
    const auto factor = View<R, R>(reduced.factor, r, r);
    SolveFromRight(factor, reduced_jacobian);
    SolveLower(factor, torque);
    load = -drift;
    AddProduct<1>(load, reduced_jacobian, torque);
    auto inertia = View<T, T>(factor_, t, t);
    SetProduct(inertia, reduced_jacobian, reduced_jacobian.transpose());
    return Cholesky(inertia, kDependence) && std::isfinite(load.sum());
  });
}

void TaskDynamics::TaskTorque(const VectorRef& acceleration,
                              Eigen::Ref<Eigen::VectorXd> torque) const {
  const ReducedDynamics& reduced = contact_->reduced();
  const Index k = reduced.num_joints, t = rows_;
  eigen_assert(acceleration.size() == t && torque.size() == k);
  WithTaskSizes(reduced, t, [&]<int K, bool Loop, int T>() {
    StackVector<T> force = Eigen::Map<const StackVector<T>>(acceleration.data(), t) +
                           Eigen::Map<const StackVector<T>>(load_.data(), t);
    const auto factor = View<T, T>(factor_, t, t);
    SolveLower(factor, force);
    SolveLowerTransposed(factor, force);
    Eigen::Map<StackVector<K>> result(torque.data(), k);
    SetTransposedProduct(result, View<T, K>(joint_jacobian_, t, k), force);
    RemoveInternalLoad<K, Loop>(reduced, &result);
  });
}

void TaskDynamics::ProjectIntoNullSpace(Eigen::Ref<Eigen::VectorXd> torque) const {
  const ReducedDynamics& reduced = contact_->reduced();
  const Index k = reduced.num_joints, t = rows_, r = rank_;
  eigen_assert(torque.size() == k);
  WithTaskSizes(reduced, t, [&]<int K, bool Loop, int T>() {
    // Γ − V Vᵀ (J [Φ; I])ᵀ Λ T L⁻¹ Vᵀ Γ
    constexpr int R = Rank<K, Loop>();
    Eigen::Map<StackVector<K>> result(torque.data(), k);
    StackVector<R> y(r);
    if constexpr (Loop) {
      SetTransposedProduct(y, View<K, R>(reduced.rotation, k, r, 6), result);
    } else {
      y = result;
    }
    SolveLower(View<R, R>(reduced.factor, r, r), y);
    StackVector<T> force(t);
    SetProduct(force, View<T, R>(reduced_jacobian_, t, r), y);
    const auto factor = View<T, T>(factor_, t, t);
    SolveLower(factor, force);
    SolveLowerTransposed(factor, force);
    StackVector<K> blocked(k);
    SetTransposedProduct(blocked, View<T, K>(joint_jacobian_, t, k), force);
    RemoveInternalLoad<K, Loop>(reduced, &blocked);
    result -= blocked;
  });
}

Eigen::MatrixXd TaskDynamics::Lambda() const {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(rows_, rows_);
  factor().triangularView<Eigen::Lower>().solveInPlace(inverse);
  return inverse.transpose() * inverse;
}

Eigen::VectorXd TaskDynamics::P() const {
  const ReducedDynamics& reduced = contact_->reduced();
  Eigen::VectorXd torque = reduced.gravity_torque;
  if (reduced.closed_loop()) torque = reduced.rotation.rightCols(rank_).transpose() * torque;
  reduced.factor.topLeftCorner(rank_, rank_).triangularView<Eigen::Lower>().solveInPlace(torque);
  return Lambda() * (reduced_jacobian() * torque);
}

Eigen::VectorXd TaskDynamics::Mu() const { return Lambda() * load_.head(rows_) - P(); }

Eigen::MatrixXd TaskDynamics::JBarTranspose() const {
  const ReducedDynamics& reduced = contact_->reduced();
  const Index k = reduced.num_joints;
  // Zᵀ = L⁻¹ Vᵀ [Φᵀ I]
  Eigen::MatrixXd z(k, k + 6);
  z << reduced.phi_t.topRows(k), Eigen::MatrixXd::Identity(k, k);
  if (reduced.closed_loop()) z = (reduced.rotation.rightCols(rank_).transpose() * z).eval();
  reduced.factor.topLeftCorner(rank_, rank_).triangularView<Eigen::Lower>().solveInPlace(z);
  return Lambda() * (reduced_jacobian() * z);
}

Eigen::MatrixXd TaskDynamics::JTildeTranspose() const {
  const ReducedDynamics& reduced = contact_->reduced();
  Eigen::MatrixXd result = joint_jacobian_.topRows(rows_).transpose();
  if (reduced.closed_loop()) {
    const auto basis = reduced.rotation.rightCols(rank_);
    result = (basis * (basis.transpose() * result)).eval();
  }
  return result;
}

void GravityCompensation(const ContactDynamics& contact, Eigen::Ref<Eigen::VectorXd> torque) {
  const ReducedDynamics& reduced = contact.reduced();
  eigen_assert(torque.size() == reduced.num_joints);
  torque = reduced.gravity_torque;
  WithSizes(reduced, [&]<int K, bool Loop>() {
    Eigen::Map<StackVector<K>> result(torque.data(), reduced.num_joints);
    RemoveInternalLoad<K, Loop>(reduced, &result);
  });
}

}  // namespace poise::balance
