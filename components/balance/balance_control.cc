#include "components/balance/balance_control.h"

#include <algorithm>
#include <array>
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

/// Base wrench that joint torques produce, all in all.
template <int S, bool Loop>
Vector6d BaseWrench(const ReducedDynamics& reduced, const VectorRef& torque) {
  constexpr int R = Rank<S, Loop>();
  const Index s = reduced.num_legs, r = reduced.legs_rank();
  SplitVector<S> net;
  Gather(reduced, torque.data(), &net);
  net.legs -= Eigen::Map<const StackVector<S>>(reduced.bias.joint_torque.data(), s);
  net.others -= reduced.bias.others_torque;
  StackVector<R> z(r);
  SplitVector<S> acceleration;
  acceleration.others = net.others;
  ToReduced<S, Loop>(reduced, net.legs, &z, &acceleration.others);
  SolveReducedTransposed<S, Loop>(reduced, &z, &acceleration.others);
  acceleration.legs = Eigen::Map<const StackVector<S>>(reduced.bias.joint_acceleration.data(), s);
  if constexpr (Loop) {
    AddProduct<1>(acceleration.legs, View<S, R>(reduced.rotation, s, r, 6), z);
  } else {
    acceleration.legs = z;
  }
  return reduced.bias.base_wrench - BaseInertia(reduced, acceleration);
}

}  // namespace

BalanceControl::BalanceControl(int num_joints, int max_protected_rows) : num_joints_(num_joints) {
  if (num_joints < 1 || num_joints > kMaxJoints || max_protected_rows < 1 ||
      max_protected_rows > num_joints) {
    throw std::invalid_argument("BalanceControl: 1 to 128 joints, 1 to that many protected rows");
  }
  moment_.setZero(num_joints, 2);
  projection_.setZero(max_protected_rows, 2);
  factor_.setZero(max_protected_rows, max_protected_rows);
}

BalanceStatus BalanceControl::Compute(const ContactDynamics& contact,
                                      const TaskDynamics& protected_task,
                                      const ContactGeometry& geometry, const ContactLimits& limits,
                                      bool enabled, Eigen::Ref<Eigen::VectorXd> torque,
                                      BalanceResult* result, Movers movers) {
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
  return ComputeWith(nearest, contact, protected_task, geometry, enabled, torque, result, movers);
}

BalanceStatus BalanceControl::Compute(const ContactDynamics& contact,
                                      const TaskDynamics& protected_task,
                                      const ContactGeometry& geometry, const ConvexPolygon& region,
                                      bool enabled, Eigen::Ref<Eigen::VectorXd> torque,
                                      BalanceResult* result, Movers movers) {
  const auto nearest = [&](const Eigen::Vector2d& cop) { return NearestPoint(region, cop); };
  return ComputeWith(nearest, contact, protected_task, geometry, enabled, torque, result, movers);
}

template <class Nearest>
BalanceStatus BalanceControl::ComputeWith(const Nearest& nearest, const ContactDynamics& contact,
                                          const TaskDynamics& protected_task,
                                          const ContactGeometry& geometry, bool enabled,
                                          Eigen::Ref<Eigen::VectorXd> torque, BalanceResult* result,
                                          Movers movers) {
  const ReducedDynamics& reduced = contact.reduced();
  *result = BalanceResult{};
  const int contacts = Count(geometry.in_contact);
  if (6 * contacts != reduced.num_contact_rows || protected_task.num_rows() > projection_.rows() ||
      reduced.num_joints != num_joints_ || torque.size() != num_joints_ ||
      !FrameO(geometry.sole, geometry.in_contact, &result->frame_o)) {
    return BalanceStatus::kSingular;
  }
  return WithSizes(reduced, [&]<int S, bool Loop>() {
    constexpr int R = Rank<S, Loop>();
    const Index s = reduced.num_legs, r = reduced.legs_rank(), t = protected_task.num_rows();
    const bool keep_others = movers == Movers::kLegs && reduced.filled_others > 0;

    // (35): the base rows of the equations of motion are the resultant of all contacts, seen from
    // the base.
    const Eigen::Isometry3d& root =
        geometry.sole[geometry.in_contact[Foot::kRight] ? Foot::kRight : Foot::kLeft];
    const Matrix6d to_o = WrenchTransform(result->frame_o, root).lazyProduct(reduced.root_transfer);
    result->resultant_task = to_o.lazyProduct(BaseWrench<S, Loop>(reduced, torque));
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
    Eigen::Matrix<double, S, 2, 0, S == Dynamic ? kMaxJoints : S, 2> joints(s, 2);
    joints.setZero();
    AddProduct<-1>(joints, View<S, 6>(reduced.psi_t, s, 6), rows_t);
    auto d = View<R, 2>(moment_, r, 2);
    std::array<OthersVector, 2> d_others;
    for (int i = 0; i < 2; ++i) {
      auto column = d.col(i);
      d_others[i].setZero(reduced.filled_others);
      AddColumns(-1, OthersCoupling(reduced), 6, rows_t.col(i).data(), d_others[i].data());
      ToReduced<S, Loop>(reduced, StackVector<S>(joints.col(i)), &column, &d_others[i]);
      // The others' accelerations depend on their own coordinates alone: y_o = L_ooᵀ q̈_o.
      if (keep_others) d_others[i].setZero(reduced.filled_others);
    }
    const auto products = [&](Eigen::Matrix2d* gram) {
      gram->noalias() = d.transpose().lazyProduct(d);
      if (reduced.filled_others == 0) return;
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) (*gram)(i, j) += d_others[i].dot(d_others[j]);
      }
    };
    Eigen::Matrix2d raw;
    products(&raw);

    const MatrixRef task = protected_task.reduced_jacobian();
    if (keep_others) {
      auto own = factor_.topLeftCorner(t, t);
      for (Index j = 0; j < t; ++j) {
        for (Index i = j; i < t; ++i) own(i, j) = task.row(i).dot(task.row(j));
      }
      if (!Cholesky(own, kMomentDependence)) return BalanceStatus::kSingular;
    }
    const MatrixRef task_factor =
        keep_others ? MatrixRef(factor_.topLeftCorner(t, t)) : protected_task.factor();
    const BlockMatrix task_others = protected_task.others_reduced();
    auto projection = View<Dynamic, 2>(projection_, t, 2);
    for (int i = 0; i < 2; ++i) {
      auto force = projection.col(i);
      force.setZero();
      for (Index j = 0; j < r; ++j) force += task.col(j) * d(j, i);
      if (!keep_others) AddDots(1, task_others, t, d_others[i].data(), force.data());
      SolveLower(task_factor, force);
      SolveLowerTransposed(task_factor, force);
      for (Index j = 0; j < r; ++j) d(j, i) -= task.col(j).dot(force);
      if (!keep_others) AddColumns(-1, task_others, t, force.data(), d_others[i].data());
    }
    Eigen::Matrix2d gram;
    products(&gram);
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
    OthersVector y_others = d_others[0] * share(0) + d_others[1] * share(1);
    if (!std::isfinite(y.sum() + y_others.sum())) return BalanceStatus::kSingular;

    // Γ = V L y, q̈ = V L⁻ᵀ y
    const auto factor = View<R, R>(reduced.factor, r, r);
    StackVector<R> z = StackVector<R>::Zero(r);
    for (Index j = 0; j < r; ++j) z += factor.col(j) * y(j);
    SplitVector<S> command, acceleration;
    Gather(reduced, torque.data(), &command);
    if (reduced.filled_others > 0) {
      const BlockMatrix others = OthersFactor(reduced);
      AddColumns(1, others, r, y.data(), command.others.data());
      AddColumns(1, {others.col(r), others.rows, others.stride}, others.rows, y_others.data(),
                 command.others.data());
    }
    acceleration.others = y_others;
    SolveReducedTransposed<S, Loop>(reduced, &y, &acceleration.others);
    acceleration.legs.resize(s);
    if constexpr (Loop) {
      const auto basis = View<S, R>(reduced.rotation, s, r, 6);
      AddProduct<1>(command.legs, basis, z);
      SetProduct(acceleration.legs, basis, y);
    } else {
      command.legs += z;
      acceleration.legs = y;
    }
    Scatter(reduced, command, torque.data());
    const Vector6d change = BaseInertia(reduced, acceleration);
    result->resultant.noalias() -= to_o.lazyProduct(change);
    result->cop = CenterOfPressure(result->resultant);
    return BalanceStatus::kOk;
  });
}

}  // namespace poise::balance
