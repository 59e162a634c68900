#include "components/balance/task_dynamics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "components/balance/small_matrix.h"

namespace poise::balance {
namespace {

using Eigen::Dynamic;
using Eigen::Index;

// Smallest share of a task's inverse inertia that the tasks before it may leave (sin² of the angle
// between them).
constexpr double kDependence = 1e-12;

/// Calls `function` with the legs' joints, the support and the task rows as compile-time constants
/// where they are common.
template <class Function>
decltype(auto) WithTaskSizes(const ReducedDynamics& reduced, Index rows, Function&& function) {
  if (reduced.num_legs == 12) {
    if (reduced.closed_loop()) {
      if (rows == 6) return function.template operator()<12, true, 6>();
      if (rows == 1) return function.template operator()<12, true, 1>();
      return function.template operator()<12, true, Dynamic>();
    }
    if (rows == 12) return function.template operator()<12, false, 12>();
    if (rows == 1) return function.template operator()<12, false, 1>();
    return function.template operator()<12, false, Dynamic>();
  }
  if (reduced.closed_loop()) return function.template operator()<Dynamic, true, Dynamic>();
  return function.template operator()<Dynamic, false, Dynamic>();
}

/// x ← V Vᵀ x: the part of a torque that moves the robot. The others' is all of it.
template <int S, bool Loop, class Vector>
void RemoveInternalLoad(const ReducedDynamics& reduced, Vector* legs) {
  if constexpr (Loop) {
    // I − Q₁ Q₁ᵀ
    const auto internal = View<S, 6>(reduced.rotation, reduced.num_legs, 6);
    Vector6d load;
    SetTransposedProduct(load, internal, *legs);
    AddProduct<-1>(*legs, internal, load);
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
  others_jacobian_.setZero(WholeBlocks(num_joints), max_task_rows);
  others_reduced_.setZero(WholeBlocks(num_joints), max_task_rows);
  factor_.setZero(max_task_rows, max_task_rows);
  drift_.setZero(max_task_rows);
  load_.setZero(max_task_rows);
}

BlockMatrix TaskDynamics::others_jacobian() const {
  return {const_cast<double*>(others_jacobian_.data()), contact_->reduced().filled_others,
          others_jacobian_.outerStride()};
}

BlockMatrix TaskDynamics::others_reduced() const {
  return {const_cast<double*>(others_reduced_.data()), contact_->reduced().filled_others,
          others_reduced_.outerStride()};
}

bool TaskDynamics::Compute(const ContactDynamics& contact, const MatrixRef& jacobian,
                           const VectorRef& bias_acceleration) {
  const ReducedDynamics& reduced = contact.reduced();
  const Index k = reduced.num_joints, t = jacobian.rows();
  if (t < 1 || t > factor_.rows() || t > reduced.rank() || k != joint_jacobian_.cols() ||
      jacobian.cols() != k + 6 || bias_acceleration.size() != t) {
    return false;
  }
  contact_ = &contact;
  rows_ = static_cast<int>(t);
  legs_rank_ = reduced.legs_rank();
  return WithTaskSizes(reduced, t, [&]<int S, bool Loop, int T>() {
    constexpr int R = Rank<S, Loop>();
    const Index s = reduced.num_legs, r = legs_rank_;
    const Index o = reduced.num_others(), filled = reduced.filled_others;
    const int* const order = reduced.order.data();
    const auto base = View<T, 6>(jacobian, t, 6);
    const auto joints = View<T, Dynamic>(jacobian, t, k, 6);
    auto joint_jacobian = View<T, S>(joint_jacobian_, t, s);
    for (Index j = 0; j < s; ++j) joint_jacobian.col(j) = joints.col(order[j]);
    AddProduct<1>(joint_jacobian, base, View<S, 6>(reduced.phi_t, s, 6).transpose());

    Eigen::Map<StackVector<T>> drift(drift_.data(), t), load(load_.data(), t);
    drift = Eigen::Map<const StackVector<T>>(bias_acceleration.data(), t);
    AddProduct<1>(drift, base, reduced.bias.base_acceleration);

    auto reduced_jacobian = View<T, R>(reduced_jacobian_, t, r);
    if constexpr (Loop) {
      SetProduct(reduced_jacobian, joint_jacobian, View<S, R>(reduced.rotation, s, r, 6));
      AddProduct<1>(drift, joint_jacobian,
                    Eigen::Map<const StackVector<S>>(reduced.bias.joint_acceleration.data(), s));
    } else {
      reduced_jacobian = joint_jacobian;
    }
    StackVector<T> asked(t), left(t);
    asked.setZero();
    left.setZero();
    for (Index j = 0; j < 6; ++j) asked += base.col(j).cwiseAbs2();
    for (Index j = 0; j < k; ++j) asked += joints.col(j).cwiseAbs2();
    for (Index j = 0; j < r; ++j) left += reduced_jacobian.col(j).cwiseAbs2();
    for (Index j = 0; j < o; ++j) left += joints.col(order[s + j]).cwiseAbs2();
    if (!((left - asked * (kHeld * kHeld)).minCoeff() > 0)) return false;
    SolveFromRight(View<R, R>(reduced.factor, r, r), reduced_jacobian);

    StackVector<R> torque(r);  // L⁻¹ Vᵀ h
    OthersVector others_torque = reduced.bias.others_torque;
    ToReduced<S, Loop>(
        reduced,
        StackVector<S>(Eigen::Map<const StackVector<S>>(reduced.bias.joint_torque.data(), s)),
        &torque, &others_torque);
    load = -drift;
    AddProduct<1>(load, reduced_jacobian, torque);
    auto inertia = View<T, T>(factor_, t, t);
    SetProduct(inertia, reduced_jacobian, reduced_jacobian.transpose());
    if (filled > 0) {
      const BlockMatrix factor = OthersFactor(reduced), own = others_jacobian();
      const BlockMatrix solved = others_reduced();
      StackVector<R> row(r);
      StackVector<T> dots(t);
      for (Index i = 0; i < t; ++i) {
        double* const given = own.col(i);
        double* const x = solved.col(i);
        for (Index j = 0; j < o; ++j) given[j] = joints(i, order[s + j]);
        std::fill(given + o, given + filled, 0.0);
        std::copy_n(given, filled, x);
        row = reduced_jacobian.row(i).transpose();
        AddColumns(-1, factor, r, row.data(), x);
        SolveBlocks(factor, r, reduced.others_inverses.data(), x);
        // The factor needs the lower triangle alone.
        dots.setZero();
        AddDots(1, solved, i + 1, x, dots.data());
        inertia.row(i).head(i + 1) += dots.head(i + 1).transpose();
        AddDots(1, {x, filled, filled}, 1, others_torque.data(), &load(i));
      }
    }
    return Cholesky(inertia, kDependence) && std::isfinite(load.sum());
  });
}

void TaskDynamics::TaskTorque(const VectorRef& acceleration,
                              Eigen::Ref<Eigen::VectorXd> torque) const {
  const ReducedDynamics& reduced = contact_->reduced();
  const Index t = rows_;
  eigen_assert(acceleration.size() == t && torque.size() == reduced.num_joints);
  WithTaskSizes(reduced, t, [&]<int S, bool Loop, int T>() {
    StackVector<T> force = Eigen::Map<const StackVector<T>>(acceleration.data(), t) +
                           Eigen::Map<const StackVector<T>>(load_.data(), t);
    const auto factor = View<T, T>(factor_, t, t);
    SolveLower(factor, force);
    SolveLowerTransposed(factor, force);
    SplitVector<S> result;
    result.legs.resize(reduced.num_legs);
    SetTransposedProduct(result.legs, View<T, S>(joint_jacobian_, t, reduced.num_legs), force);
    RemoveInternalLoad<S, Loop>(reduced, &result.legs);
    result.others.setZero(reduced.filled_others);
    AddColumns(1, others_jacobian(), t, force.data(), result.others.data());
    Scatter(reduced, result, torque.data());
  });
}

void TaskDynamics::ProjectIntoNullSpace(Eigen::Ref<Eigen::VectorXd> torque) const {
  const ReducedDynamics& reduced = contact_->reduced();
  const Index s = reduced.num_legs, t = rows_, r = legs_rank_;
  eigen_assert(torque.size() == reduced.num_joints);
  WithTaskSizes(reduced, t, [&]<int S, bool Loop, int T>() {
    // Γ − V Vᵀ (J [Φ; I])ᵀ Λ T L⁻¹ Vᵀ Γ
    constexpr int R = Rank<S, Loop>();
    SplitVector<S> result;
    Gather(reduced, torque.data(), &result);
    StackVector<R> y(r);
    OthersVector others = result.others;
    ToReduced<S, Loop>(reduced, result.legs, &y, &others);
    StackVector<T> force(t);
    SetProduct(force, View<T, R>(reduced_jacobian_, t, r), y);
    AddDots(1, others_reduced(), t, others.data(), force.data());
    const auto factor = View<T, T>(factor_, t, t);
    SolveLower(factor, force);
    SolveLowerTransposed(factor, force);
    StackVector<S> blocked(s);
    SetTransposedProduct(blocked, View<T, S>(joint_jacobian_, t, s), force);
    RemoveInternalLoad<S, Loop>(reduced, &blocked);
    result.legs -= blocked;
    AddColumns(-1, others_jacobian(), t, force.data(), result.others.data());
    Scatter(reduced, result, torque.data());
  });
}

Eigen::MatrixXd TaskDynamics::Lambda() const {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(rows_, rows_);
  factor().triangularView<Eigen::Lower>().solveInPlace(inverse);
  return inverse.transpose() * inverse;
}

Eigen::MatrixXd TaskDynamics::WholeJacobian() const {
  const ReducedDynamics& reduced = contact_->reduced();
  const Index o = reduced.num_others();
  Eigen::MatrixXd whole(rows_, reduced.rank());
  whole << reduced_jacobian(), others_reduced_.topLeftCorner(o, rows_).transpose();
  return whole;
}

Eigen::VectorXd TaskDynamics::P() const {
  Eigen::VectorXd torque(contact_->reduced().rank());
  contact_->ReduceTorque(contact_->reduced().gravity_torque, torque);
  return Lambda() * (WholeJacobian() * torque);
}

Eigen::VectorXd TaskDynamics::Mu() const { return Lambda() * load_.head(rows_) - P(); }

Eigen::MatrixXd TaskDynamics::JBarTranspose() const {
  const ReducedDynamics& reduced = contact_->reduced();
  const Index k = reduced.num_joints;
  // Zᵀ = L⁻¹ Vᵀ [Φᵀ I]
  Eigen::MatrixXd force = Eigen::MatrixXd::Zero(k, k + 6);
  for (Index i = 0; i < reduced.num_legs; ++i) {
    force.block(reduced.order[static_cast<size_t>(i)], 0, 1, 6) = reduced.phi_t.row(i);
  }
  force.rightCols(k).setIdentity();
  Eigen::MatrixXd z(reduced.rank(), k + 6);
  for (Index i = 0; i < k + 6; ++i) contact_->ReduceTorque(force.col(i), z.col(i));
  return Lambda() * (WholeJacobian() * z);
}

Eigen::MatrixXd TaskDynamics::JTildeTranspose() const {
  const ReducedDynamics& reduced = contact_->reduced();
  const Index s = reduced.num_legs;
  Eigen::MatrixXd legs = joint_jacobian_.topLeftCorner(rows_, s).transpose();
  if (reduced.closed_loop()) {
    const auto basis = reduced.rotation.rightCols(reduced.legs_rank());
    legs = (basis * (basis.transpose() * legs)).eval();
  }
  Eigen::MatrixXd result(reduced.num_joints, rows_);
  for (Index i = 0; i < reduced.num_joints; ++i) {
    const Index joint = reduced.order[static_cast<size_t>(i)];
    if (i < s) {
      result.row(joint) = legs.row(i);
    } else {
      result.row(joint) = others_jacobian_.row(i - s).head(rows_);
    }
  }
  return result;
}

void GravityCompensation(const ContactDynamics& contact, Eigen::Ref<Eigen::VectorXd> torque) {
  const ReducedDynamics& reduced = contact.reduced();
  eigen_assert(torque.size() == reduced.num_joints);
  WithSizes(reduced, [&]<int S, bool Loop>() {
    SplitVector<S> result;
    Gather(reduced, reduced.gravity_torque.data(), &result);
    RemoveInternalLoad<S, Loop>(reduced, &result.legs);
    Scatter(reduced, result, torque.data());
  });
}

}  // namespace poise::balance
