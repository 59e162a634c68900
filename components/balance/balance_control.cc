#include "components/balance/balance_control.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "components/balance/small_matrix.h"

namespace poise::balance {
namespace {

using Eigen::Dynamic;
using Eigen::Index;
using Rows2X6 = Eigen::Matrix<double, 2, 6>;

// The moments' two rows of (42) must be independent this well, relative to their size.
constexpr double kMomentDependence = 1e-12;

/// Moments about the axes of O_d, a point of frame O's plane, from a wrench in O: rows 4 and 5 of
/// ᴼᵈK.
Rows2X6 MomentRows(const Eigen::Vector2d& point) {
  Rows2X6 rows = Rows2X6::Zero();
  rows(0, 2) = -point.y();
  rows(0, 3) = 1;
  rows(1, 2) = point.x();
  rows(1, 4) = 1;
  return rows;
}

/// Joint acceleration's part that `torque` causes, and the base wrench of all.
template <int K, bool Loop>
Vector6d BaseWrench(const ReducedDynamics& reduced, const VectorRef& torque) {
  constexpr int R = Rank<K, Loop>();
  const Index k = reduced.num_joints, r = reduced.rank();
  StackVector<K> net = Eigen::Map<const StackVector<K>>(torque.data(), k) -
                       Eigen::Map<const StackVector<K>>(reduced.bias.joint_torque.data(), k);
  StackVector<R> z(r);
  const auto basis = View<K, R>(reduced.rotation, k, r, Loop ? 6 : 0);
  if constexpr (Loop) {
    SetTransposedProduct(z, basis, net);
  } else {
    z = net;
  }
  const auto factor = View<R, R>(reduced.factor, r, r);
  SolveLower(factor, z);
  SolveLowerTransposed(factor, z);
  StackVector<K> acceleration =
      Eigen::Map<const StackVector<K>>(reduced.bias.joint_acceleration.data(), k);
  if constexpr (Loop) {
    AddProduct<1>(acceleration, basis, z);
  } else {
    acceleration = z;
  }
  Vector6d inertial;
  SetTransposedProduct(inertial, View<K, 6>(reduced.psi_t, k, 6), acceleration);
  return reduced.bias.base_wrench - inertial;
}

}  // namespace

BalanceControl::BalanceControl(int num_joints, int max_protected_rows) {
  if (num_joints < 1 || num_joints > kMaxJoints || max_protected_rows < 1 ||
      max_protected_rows > num_joints) {
    throw std::invalid_argument("BalanceControl: 1 to 128 joints, 1 to that many protected rows");
  }
  moment_.setZero(num_joints, 2);
  projection_.setZero(max_protected_rows, 2);
}

BalanceStatus BalanceControl::Compute(const ContactDynamics& contact,
                                      const TaskDynamics& protected_task,
                                      const ContactGeometry& geometry, const ContactLimits& limits,
                                      bool enabled, Eigen::Ref<Eigen::VectorXd> torque,
                                      BalanceResult* result) {
  const auto nearest = [&](const Eigen::Vector2d& cop) {
    Eigen::Vector2d allowed = cop;
    if (std::abs(cop.x()) > limits.half_length) {
      allowed.x() = std::copysign(limits.half_length, cop.x());
    }
    if (std::abs(cop.y()) > limits.half_width) {
      allowed.y() = std::copysign(limits.half_width, cop.y());
    }
    return allowed;
  };
  return ComputeWith(nearest, contact, protected_task, geometry, enabled, torque, result);
}

BalanceStatus BalanceControl::Compute(const ContactDynamics& contact,
                                      const TaskDynamics& protected_task,
                                      const ContactGeometry& geometry, const ConvexPolygon& region,
                                      bool enabled, Eigen::Ref<Eigen::VectorXd> torque,
                                      BalanceResult* result) {
  const auto nearest = [&](const Eigen::Vector2d& cop) { return NearestPoint(region, cop); };
  return ComputeWith(nearest, contact, protected_task, geometry, enabled, torque, result);
}

template <class Nearest>
BalanceStatus BalanceControl::ComputeWith(const Nearest& nearest, const ContactDynamics& contact,
                                          const TaskDynamics& protected_task,
                                          const ContactGeometry& geometry, bool enabled,
                                          Eigen::Ref<Eigen::VectorXd> torque,
                                          BalanceResult* result) {
  const ReducedDynamics& reduced = contact.reduced();
  *result = BalanceResult{};
  const int feet = geometry.in_contact[0] + geometry.in_contact[1];
  if (6 * feet != reduced.num_contact_rows || protected_task.num_rows() > projection_.rows() ||
      reduced.num_joints != moment_.rows() || torque.size() != moment_.rows() ||
      !FrameO(geometry.sole, geometry.in_contact, &result->frame_o)) {
    return BalanceStatus::kSingular;
  }
  return WithSizes(reduced, [&]<int K, bool Loop>() {
    constexpr int R = Rank<K, Loop>();
    const Index k = reduced.num_joints, r = reduced.rank(), t = protected_task.num_rows();

    // (35): the base rows of the equations of motion are the resultant of all contacts, seen from
    // the base.
    const Eigen::Isometry3d& root = geometry.sole[geometry.in_contact[0] ? 0 : 1];
    const Matrix6d to_o = WrenchTransform(result->frame_o, root).lazyProduct(reduced.root_transfer);
    result->resultant_task = to_o.lazyProduct(BaseWrench<K, Loop>(reduced, torque));
    result->resultant = result->resultant_task;
    if (!result->resultant_task.allFinite()) return BalanceStatus::kSingular;
    if (!(result->resultant_task(2) < 0)) return BalanceStatus::kUnloaded;

    // (37), (38)
    result->cop_task = result->cop = result->cop_desired = CenterOfPressure(result->resultant_task);
    if (!result->cop_task.allFinite()) return BalanceStatus::kSingular;
    result->cop_desired = nearest(result->cop_task);
    result->active_x = result->cop_desired.x() != result->cop_task.x();
    result->active_y = result->cop_desired.y() != result->cop_task.y();
    if (!enabled || !(result->active_x || result->active_y)) return BalanceStatus::kOk;

    // (42) with y = L⁻¹ Vᵀ Γ as variable: D = −S_c ᴼᵈK Ψ V L⁻ᵀ, then D (I − T_hᵀ Λ_h T_h).
    const Rows2X6 moment_rows = MomentRows(result->cop_desired);
    const Eigen::Matrix<double, 6, 2> rows_t = (moment_rows.lazyProduct(to_o)).transpose();
    Eigen::Matrix<double, K, 2, 0, K == Dynamic ? kMaxJoints : K, 2> joints(k, 2);
    joints.setZero();
    AddProduct<-1>(joints, View<K, 6>(reduced.psi_t, k, 6), rows_t);
    auto d = View<R, 2>(moment_, r, 2);
    const auto basis = View<K, R>(reduced.rotation, k, r, Loop ? 6 : 0);
    if constexpr (Loop) {
      SetTransposedProduct(d.col(0), basis, joints.col(0));
      SetTransposedProduct(d.col(1), basis, joints.col(1));
    } else {
      d = joints;
    }
    const auto factor = View<R, R>(reduced.factor, r, r);
    SolveLower(factor, d.col(0));
    SolveLower(factor, d.col(1));
    Eigen::Matrix2d raw;
    raw.noalias() = d.transpose().lazyProduct(d);

    const MatrixRef task = protected_task.reduced_jacobian();
    const MatrixRef task_factor = protected_task.factor();
    auto projection = View<Dynamic, 2>(projection_, t, 2);
    for (int i = 0; i < 2; ++i) {
      auto force = projection.col(i);
      force.setZero();
      for (Index j = 0; j < r; ++j) force += task.col(j) * d(j, i);
      SolveLower(task_factor, force);
      SolveLowerTransposed(task_factor, force);
      for (Index j = 0; j < r; ++j) d(j, i) -= task.col(j).dot(force);
    }
    Eigen::Matrix2d gram;
    gram.noalias() = d.transpose().lazyProduct(d);
    const double determinant = gram.determinant();
    if (!(determinant > kMomentDependence * raw(0, 0) * raw(1, 1) && determinant < HUGE_VAL)) {
      return BalanceStatus::kSingular;
    }
    // (41), (42): the increment of y that makes the moments about O_d vanish.
    const Eigen::Vector2d moment = moment_rows.lazyProduct(result->resultant_task);
    const Eigen::Vector2d share(-(gram(1, 1) * moment(0) - gram(0, 1) * moment(1)) / determinant,
                                -(gram(0, 0) * moment(1) - gram(1, 0) * moment(0)) / determinant);
    StackVector<R> y(r);
    y.noalias() = d.lazyProduct(share);
    if (!std::isfinite(y.sum())) return BalanceStatus::kSingular;

    // Γ = V L y, q̈ = V L⁻ᵀ y
    StackVector<R> z = StackVector<R>::Zero(r);
    for (Index j = 0; j < r; ++j) z += factor.col(j) * y(j);
    Eigen::Map<StackVector<K>> command(torque.data(), k);
    StackVector<K> acceleration(k);
    SolveLowerTransposed(factor, y);
    if constexpr (Loop) {
      AddProduct<1>(command, basis, z);
      SetProduct(acceleration, basis, y);
    } else {
      command += z;
      acceleration = y;
    }
    Vector6d change;
    SetTransposedProduct(change, View<K, 6>(reduced.psi_t, k, 6), acceleration);
    result->resultant.noalias() -= to_o.lazyProduct(change);
    result->cop = CenterOfPressure(result->resultant);
    return BalanceStatus::kOk;
  });
}

}  // namespace poise::balance
