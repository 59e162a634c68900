#include "components/balance/task_hierarchy.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "components/balance/small_matrix.h"

namespace poise::balance {
namespace {

using Eigen::Index;

// A row of unit length of which this is left lies in the levels above, to rounding.
constexpr double kNothingLeft = 1e-7;

}  // namespace

TaskHierarchy::TaskHierarchy(int num_joints, int max_rows, int max_levels)
    : first_(num_joints, std::max(1, std::min(max_rows, num_joints))) {
  if (max_rows < 1 || max_levels < 1) {
    throw std::invalid_argument("TaskHierarchy: at least one row and one level");
  }
  const Index k = num_joints;
  levels_.resize(static_cast<size_t>(max_levels));
  basis_.setZero(k, k);
  rows_.setZero(k, max_rows);
  coefficients_.setZero(max_rows, k);
  normal_.setZero(k, k);
  for (auto* v : {&scale_, &load_, &wanted_}) v->setZero(max_rows);
  for (auto* v : {&torque_, &fading_, &step_, &reduced_, &change_}) v->setZero(k);
}

int TaskHierarchy::num_free() const {
  Index taken = 0;
  for (const Level& level : levels()) taken += level.directions;
  return static_cast<int>(span_ - taken);
}

bool TaskHierarchy::Compute(const ContactDynamics& contact, const MatrixRef& jacobian,
                            const VectorRef& bias_acceleration, const VectorRef& acceleration,
                            std::span<const int> level_rows, const Eigen::VectorXd* others) {
  contact_ = &contact;
  num_levels_ = 0;
  rank_ = contact.reduced().rank();
  others_held_ = others != nullptr;
  span_ = others_held_ ? contact.reduced().legs_rank() : rank_;
  basis_size_ = 0;
  num_fading_ = 0;
  Index rows = 0, most = 0;
  for (const int t : level_rows) {
    if (t < 1) return false;
    rows += t;
    most = std::max<Index>(most, t);
  }
  if (level_rows.empty() || level_rows.size() > levels_.size() || most > rows_.cols() ||
      jacobian.rows() != rows || bias_acceleration.size() != rows || acceleration.size() != rows ||
      contact.num_joints() != torque_.size()) {
    return false;
  }
  if (others_held_) {
    return others->size() == torque_.size() &&
           ComputeHolding(jacobian, bias_acceleration, acceleration, level_rows, *others);
  }
  const Index first = level_rows[0];
  if (!first_.Compute(contact, jacobian.topRows(first), bias_acceleration.head(first))) {
    return false;
  }
  first_.TaskTorque(acceleration.head(first), torque_);
  levels_[0] = {static_cast<int>(first), static_cast<int>(first), true};
  num_levels_ = 1;
  if (level_rows.size() == 1) return torque_.allFinite();

  auto u = reduced_.head(rank_);
  contact.ReduceTorque(torque_, u);
  contact.ReduceRows(jacobian.topRows(first), bias_acceleration.head(first),
                     rows_.topLeftCorner(rank_, first), load_.head(first));
  bool complete = true;
  ExtendBasis(first, &complete);
  change_.head(rank_) = u;
  Index row = first;
  for (size_t i = 1; i < level_rows.size(); ++i) {
    if (!AddLevel(row, level_rows[i], jacobian, bias_acceleration, acceleration)) return false;
    row += level_rows[i];
  }
  // What the levels below have added.
  u -= change_.head(rank_);
  contact.ExpandTorque(u, change_);
  torque_ += change_;
  return torque_.allFinite();
}

bool TaskHierarchy::ComputeHolding(const MatrixRef& jacobian, const VectorRef& bias_acceleration,
                                   const VectorRef& acceleration, std::span<const int> level_rows,
                                   const Eigen::VectorXd& others) {
  auto u = reduced_.head(rank_);
  contact_->HoldOthers(others, u);
  Index row = 0;
  for (const int t : level_rows) {
    if (!AddLevel(row, t, jacobian, bias_acceleration, acceleration)) return false;
    if (row == 0 && levels_[0].directions < t) return false;
    row += t;
  }
  contact_->ExpandTorque(u, torque_);
  return torque_.allFinite();
}

bool TaskHierarchy::AddLevel(Index first_row, Index t, const MatrixRef& jacobian,
                             const VectorRef& bias_acceleration, const VectorRef& acceleration) {
  auto u = reduced_.head(rank_);
  contact_->ReduceRows(jacobian.middleRows(first_row, t), bias_acceleration.segment(first_row, t),
                       rows_.topLeftCorner(rank_, t), load_.head(t));
  auto wanted = wanted_.head(t);
  wanted = acceleration.segment(first_row, t) + load_.head(t);
  wanted.noalias() -= rows_.topLeftCorner(rank_, t).transpose() * u;
  if (!std::isfinite(wanted.sum())) return false;
  const Index before = basis_size_;
  bool complete = true;
  const Index taken = ExtendBasis(t, &complete);
  levels_[num_levels_++] = {static_cast<int>(t), static_cast<int>(taken), complete};
  if (taken == 0) return true;

  // min |C z − e|² + Σ λ² z²: C, e scaled by row, λ only in directions that fade.
  wanted.array() *= scale_.head(t).array();
  const auto c = coefficients_.topLeftCorner(t, taken);
  auto z = step_.head(taken);
  z.noalias() = c.transpose() * wanted;
  auto normal = normal_.topLeftCorner(taken, taken);
  normal.triangularView<Eigen::Lower>() = c.transpose().lazyProduct(c);
  normal.diagonal() += fading_.head(taken);
  if (!Cholesky(normal, 0.0)) return false;
  SolveLower(normal, z);
  SolveLowerTransposed(normal, z);
  u.head(span_).noalias() += basis_.block(0, before, span_, taken) * z;
  return true;
}

Index TaskHierarchy::ExtendBasis(Index t, bool* complete) {
  auto rows = rows_.topLeftCorner(span_, t);
  for (Index i = 0; i < t; ++i) {
    const double length = rows.col(i).norm();
    scale_(i) = length > 0 ? 1 / length : 0;
    rows.col(i) *= scale_(i);
    *complete &= length > 0;
    RemoveBasis(rows.col(i));
  }
  Index taken = 0;
  for (; basis_size_ < span_ && taken < t; ++taken) {
    Index next = 0;
    const double left = std::sqrt(rows.colwise().squaredNorm().maxCoeff(&next));
    if (!(left > kNothingLeft)) break;
    auto direction = basis_.col(basis_size_).head(span_);
    direction = rows.col(next) / left;
    // Taken out twice: what rounding left of the basis is so much longer now.
    RemoveBasis(direction);
    direction.normalize();
    ++basis_size_;
    for (Index i = 0; i < t; ++i) {
      const double share = direction.dot(rows.col(i));
      coefficients_(i, taken) = share;
      rows.col(i) -= direction * share;
    }
    const double faded = std::min(1.0, left / kFading);
    fading_(taken) = kFading * kFading * (1 - faded * faded);
    *complete &= faded == 1;
    num_fading_ += faded == 1 ? 0 : 1;
  }
  *complete &= taken == t;
  return taken;
}

void TaskHierarchy::RemoveBasis(Eigen::Ref<Eigen::VectorXd> vector) const {
  for (int pass = 0; pass < 2; ++pass) {
    for (Index j = 0; j < basis_size_; ++j) {
      const auto direction = basis_.col(j).head(span_);
      vector -= direction * direction.dot(vector);
    }
  }
}

void TaskHierarchy::ProjectIntoNullSpace(Eigen::Ref<Eigen::VectorXd> torque) const {
  if (num_levels_ == 1 && !others_held_) {
    first_.ProjectIntoNullSpace(torque);
    return;
  }
  StackVector<Eigen::Dynamic> u(rank_);
  contact_->ReduceTorque(torque, u);
  u.tail(rank_ - span_).setZero();
  RemoveBasis(u.head(span_));
  contact_->ExpandTorque(u, torque);
}

}  // namespace poise::balance
