#include "components/balance/step/step_balance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "components/balance/contact_conditions.h"

namespace poise::balance {
namespace {

using Eigen::Index;
using Column12 = Eigen::Matrix<double, 12, 1>;

// A sole: its load, edges, two pairs of friction faces, the moment's eight.
constexpr Index kMostSole = 1 + ConvexPolygon::kMaxCorners + 4 + 8;
// Bounds that are met at once, at most: the coordinates are fewer.
constexpr int kMostMet = 64;
constexpr int kMostRounds = 20;
// What an internal moment of 1 N·m counts beside a change of the motion that takes as much: next to
// nothing, and enough for the wrenches to be determined.
constexpr double kInternal = 0.01, kLeastInternal = 1e-6;
// Added to the dual problem's diagonal of 1: bounds that say the same have one solution.
constexpr double kSoftness = 1e-9;
constexpr double kTolerance = 1e-6;  // of a bound's own norm times that of the step
// Share of a torque limit that stays free: bounds are met to a rounding, and a motor that cut the
// torque by it would give another wrench than the one computed.
constexpr double kTorqueRounding = 1e-4;
constexpr double kHeldRow = 1e-9;  // squared norm of a row that the contacts hold already

/// The row a of a · F ≤ 0 that keeps the centre of pressure of F inside the edge from corner `i`
/// on: out · (−M_y, M_x) ≥ out · corner F_z, as F_z < 0.
Vector6d EdgeRow(std::span<const Eigen::Vector2d> corners, size_t i) {
  const Eigen::Vector2d along = (corners[(i + 1) % corners.size()] - corners[i]).normalized();
  const Eigen::Vector2d out(along.y(), -along.x());
  return (Vector6d() << 0, 0, out.dot(corners[i]), -out.y(), out.x(), 0).finished();
}

}  // namespace

StepBalance::StepBalance(int num_joints, int most_held) : num_joints_(num_joints), lcp_(kMostMet) {
  const Index k = num_joints;
  const Index most = 2 * kMostSole + ConvexPolygon::kMaxCorners + 2 * k;
  torque_of_ = Eigen::MatrixXd::Zero(k, k);
  wrench_of_ = Eigen::MatrixXd::Zero(12, k);
  metric_ = Eigen::MatrixXd::Zero(k, k);
  bound_ = Eigen::MatrixXd::Zero(k, most);
  room_ = Eigen::VectorXd::Zero(most);
  held_t_ = Eigen::MatrixXd::Zero(k, most_held);
  held_load_ = held_bias_ = Eigen::VectorXd::Zero(most_held);
  zero_ = unit_ = change_ = step_ = Eigen::VectorXd::Zero(k);
  wrench_ = wrench_at_rest_ = Eigen::VectorXd::Zero(12);
  met_.reserve(kMostMet);
  answer_ = Eigen::MatrixXd::Zero(k, kMostMet);
  dual_ = Eigen::MatrixXd::Zero(kMostMet, kMostMet);
  dual_room_ = none_ = force_ = Eigen::VectorXd::Zero(kMostMet);
  unbounded_ = Eigen::VectorXd::Constant(kMostMet, std::numeric_limits<double>::infinity());
}

Index StepBalance::Span(const ContactDynamics& contact, const StepBounds& bounds, Movers movers) {
  const ReducedDynamics& reduced = contact.reduced();
  const Index rank = reduced.rank();
  // The coordinates of the others come last.
  const Index moved = movers == Movers::kLegs ? reduced.legs_rank() : rank;
  const Index n = moved + (reduced.closed_loop() ? 6 : 0);
  contact.ExpectedWrench(zero_, wrench_at_rest_.head(wrench_rows_));
  auto unit = unit_.head(rank);
  unit.setZero();
  for (Index j = 0; j < moved; ++j) {
    unit[j] = 1;
    contact.ExpandTorque(unit, torque_of_.col(j));
    unit[j] = 0;
    contact.ExpectedWrench(torque_of_.col(j), wrench_of_.col(j).head(wrench_rows_));
    wrench_of_.col(j).head(wrench_rows_) -= wrench_at_rest_.head(wrench_rows_);
  }
  metric_.topLeftCorner(n, n).setIdentity();
  if (!reduced.closed_loop()) return n;
  // What one foot presses more and the other less moves nothing, (52).
  const Matrix6d transfer = WrenchTransform(bounds.sole[0], bounds.sole[1]);
  for (Index i = 0; i < 6; ++i) {
    auto wrench = wrench_of_.col(moved + i);
    wrench.head<6>() = -transfer.col(i);
    wrench.tail<6>() = Vector6d::Unit(i);
    torque_of_.col(moved + i).noalias() =
        contact.contact_jacobian().rightCols(num_joints_).transpose().lazyProduct(wrench);
  }
  const auto internal = torque_of_.middleCols(moved, 6);
  metric_.block(moved, moved, 6, 6).noalias() =
      kInternal * internal.transpose().lazyProduct(internal);
  metric_.block(moved, moved, 6, 6).diagonal().array() += kLeastInternal;
  return n;
}

void StepBalance::Hold(const ContactDynamics& contact, const HeldMotion& held, Index coordinates) {
  const Index rank = contact.reduced().rank(), t = held.jacobian.rows();
  const Index moved = coordinates - (contact.reduced().closed_loop() ? 6 : 0);
  contact.ReduceRows(held.jacobian, held_bias_.head(t), held_t_.topLeftCorner(rank, t),
                     held_load_.head(t));
  for (Index i = 0; i < t; ++i) {
    const auto row = held_t_.col(i).head(moved);
    const double size = row.squaredNorm();
    if (!(held.weight[i] > 0) || size < kHeldRow) continue;
    const double weight = held.weight[i] / size;
    for (Index c = 0; c < moved; ++c) {
      metric_.col(c).head(moved) += weight * row[c] * row;
    }
  }
}

void StepBalance::AddWrench(const Column12& a, double room) {
  const auto rows = a.head(wrench_rows_);
  bound_.col(bounds_).head(coordinates_).noalias() =
      wrench_of_.topLeftCorner(wrench_rows_, coordinates_).transpose().lazyProduct(rows);
  room_[bounds_++] = room - rows.dot(wrench_.head(wrench_rows_));
}

void StepBalance::AddSole(const SoleBounds& bounds, Index row) {
  Column12 a = Column12::Zero();
  const auto add = [&](const Vector6d& own, double room) {
    a.segment<6>(row) = own;
    AddWrench(a, room);
  };
  Vector6d own;
  own << 0, 0, 1, 0, 0, 0;
  add(own, -bounds.least_load);
  const auto corners = bounds.sole.corners();
  Eigen::Vector2d least = corners[0], most = corners[0];
  for (size_t i = 0; i < corners.size(); ++i) {
    add(EdgeRow(corners, i), 0);
    least = least.cwiseMin(corners[i]);
    most = most.cwiseMax(corners[i]);
  }
  // The pyramid within the cone.
  const double friction = bounds.friction / std::sqrt(2.0);
  const Eigen::Vector2d centre = 0.5 * (least + most), half = 0.5 * (most - least);
  for (const double side : {1.0, -1.0}) {
    own << side, 0, friction, 0, 0, 0;
    add(own, 0);
    own << 0, side, friction, 0, 0, 0;
    add(own, 0);
    // ±M_z ≤ μ (X + Y) |F_z| − |Y F_x ∓ μ M_x| − |X F_y ∓ μ M_y| about the sole's centre.
    for (const double first : {1.0, -1.0}) {
      for (const double second : {1.0, -1.0}) {
        const double roll = -first * side * friction, pitch = -second * side * friction;
        own << first * half.y() + side * centre.y(), second * half.x() - side * centre.x(),
            friction * half.sum() - roll * centre.y() + pitch * centre.x(), roll, pitch, side;
        add(own, 0);
      }
    }
  }
}

void StepBalance::AddRegion(const StepBounds& bounds) {
  const auto corners = bounds.region.corners();
  std::array<Matrix6d, 2> transfer;
  for (size_t f = 0; f < 2; ++f) {
    if (!bounds.in_contact[f]) continue;
    transfer[f] = WrenchTransform(bounds.frame_o, bounds.sole[f]).transpose();
  }
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vector6d own = EdgeRow(corners, i);
    Column12 a = Column12::Zero();
    Index row = 0;
    for (size_t f = 0; f < 2; ++f) {
      if (!bounds.in_contact[f]) continue;
      a.segment<6>(row) = transfer[f] * own;
      row += 6;
    }
    AddWrench(a, 0);
  }
}

void StepBalance::AddTorque(Index joint, const VectorRef& effort, const VectorRef& torque) {
  for (const double side : {1.0, -1.0}) {
    bound_.col(bounds_).head(coordinates_) =
        side * torque_of_.row(joint).head(coordinates_).transpose();
    room_[bounds_++] = (1 - kTorqueRounding) * effort[joint] - side * torque[joint];
  }
}

bool StepBalance::Solve() {
  const Index n = coordinates_;
  auto metric = metric_.topLeftCorner(n, n);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(metric);
  if (factor.info() != Eigen::Success) return false;
  auto step = step_.head(n);
  step.setZero();
  met_.clear();
  for (int round = 0; round < kMostRounds; ++round) {
    // The bounds that this step breaks are met from now on.
    const size_t before = met_.size();
    const double size = 1 + step.norm();
    for (Index i = 0; i < bounds_; ++i) {
      const auto bound = bound_.col(i).head(n);
      const double norm = bound.norm();
      if (!(bound.dot(step) > room_[i] + kTolerance * norm * size)) continue;
      if (met_.size() == kMostMet || std::find(met_.begin(), met_.end(), i) != met_.end()) continue;
      const auto m = static_cast<Index>(met_.size());
      auto answer = answer_.col(m).head(n);
      answer = bound;
      factor.matrixL().solveInPlace(answer);
      // Rows of one unit.
      const double scale = 1 / std::max(answer.norm(), 1e-12);
      answer *= scale;
      dual_room_[m] = -scale * room_[i];
      met_.push_back(i);
    }
    if (met_.size() == before) break;
    const auto m = static_cast<Index>(met_.size());
    for (Index c = static_cast<Index>(before); c < m; ++c) {
      for (Index r = 0; r <= c; ++r) {
        dual_(c, r) = dual_(r, c) = answer_.col(r).head(n).dot(answer_.col(c).head(n));
      }
      dual_(c, c) += kSoftness;
    }
    lcp_.Forget();
    if (!lcp_.Solve(dual_.topLeftCorner(m, m), dual_room_.head(m), none_.head(m),
                    unbounded_.head(m), force_.head(m))) {
      return false;
    }
    step.noalias() = -answer_.topLeftCorner(n, m).lazyProduct(force_.head(m));
    factor.matrixU().solveInPlace(step);
  }
  return step.allFinite();
}

bool StepBalance::Compute(const ContactDynamics& contact, const StepBounds& bounds,
                          const HeldMotion& held, const VectorRef& effort, Movers movers,
                          Eigen::Ref<Eigen::VectorXd> torque, Result* result) {
  wrench_rows_ = contact.num_contact_rows();
  const Index contacts = (bounds.in_contact[0] ? 1 : 0) + (bounds.in_contact[1] ? 1 : 0);
  if (wrench_rows_ != 6 * contacts || torque.size() != num_joints_ ||
      effort.size() != num_joints_ || held.jacobian.rows() > held_t_.cols() ||
      held.weight.size() != held.jacobian.rows()) {
    return false;
  }
  contact.ExpectedWrench(torque, wrench_.head(wrench_rows_));
  if (!wrench_.head(wrench_rows_).allFinite()) return false;
  coordinates_ = Span(contact, bounds, movers);
  Hold(contact, held, coordinates_);
  bounds_ = 0;
  Index row = 0;
  for (size_t f = 0; f < 2; ++f) {
    result->task[f].setZero();
    if (!bounds.in_contact[f]) continue;
    result->task[f] = wrench_.segment<6>(row);
    AddSole(bounds.foot[f], row);
    row += 6;
  }
  AddRegion(bounds);
  if (movers == Movers::kLegs) {
    // The legs keep no limits but their own: they would throw the robot to spare a struck arm.
    for (const int j : contact.legs()) AddTorque(j, effort, torque);
  } else {
    for (Index j = 0; j < num_joints_; ++j) AddTorque(j, effort, torque);
  }
  result->wrench = result->task;
  result->changed = false;
  if (!Solve()) return false;
  result->changed = !met_.empty();
  if (!result->changed) return true;
  const auto step = step_.head(coordinates_);
  change_.noalias() = torque_of_.leftCols(coordinates_).lazyProduct(step);
  torque += change_;
  wrench_.head(wrench_rows_).noalias() +=
      wrench_of_.topLeftCorner(wrench_rows_, coordinates_).lazyProduct(step);
  row = 0;
  for (size_t f = 0; f < 2; ++f) {
    if (!bounds.in_contact[f]) continue;
    result->wrench[f] = wrench_.segment<6>(row);
    row += 6;
  }
  return true;
}

}  // namespace poise::balance
