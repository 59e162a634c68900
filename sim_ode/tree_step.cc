#include "sim_ode/tree_step.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace poise {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Share of the load by which the bounds of friction may be off, rounds at most until they are not,
// and rounds after which they go half the way.
constexpr double kBoundsOff = 0.05;
constexpr int kMostRounds = 20, kWholeRounds = 4;

int RowsOf(const TreeStep::Contact& contact) { return contact.friction > 0 ? 3 : 1; }

Matrix3d Cross(const Vector3d& v) {
  Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

// ODE's gyroscopic torque, implicit in the step: Lacoursière 2006, "Stabilizing gyroscopic forces
// in rigid multibody simulations".
Vector3d GyroscopicTorque(const Matrix3d& inertia, const Vector3d& angular, double step) {
  const Vector3d momentum = inertia * angular;
  const Matrix3d implicit = inertia - step * Cross(momentum);
  return (inertia * (implicit.inverse() * momentum) - momentum) / step;
}

}  // namespace

TreeStep::TreeStep(std::vector<Body> bodies, int max_contacts, double step, double erp, double cfm)
    : bodies_(std::move(bodies)),
      step_(step),
      pull_(erp / step),
      cfm_(cfm / step),
      nodes_(bodies_.size()),
      rows_(3 * max_contacts, 6),
      moved_(3 * max_contacts, 6),
      system_(3 * max_contacts, 3 * max_contacts),
      normal_system_(max_contacts, max_contacts),
      wanted_(3 * max_contacts),
      lower_(3 * max_contacts),
      upper_(3 * max_contacts),
      impulses_(3 * max_contacts),
      normal_wanted_(max_contacts),
      normal_impulses_(max_contacts),
      zero_(Eigen::VectorXd::Zero(max_contacts)),
      infinite_(Eigen::VectorXd::Constant(max_contacts, std::numeric_limits<double>::infinity())),
      normals_(max_contacts),
      all_(3 * max_contacts),
      forces_(static_cast<size_t>(max_contacts)) {
  contact_bodies_.reserve(static_cast<size_t>(max_contacts));
  normal_.reserve(static_cast<size_t>(3 * max_contacts));
}

void TreeStep::Forget() {
  normals_.Forget();
  all_.Forget();
}

void TreeStep::Prepare() {
  for (size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    Node& node = nodes_[i];
    node.on_path = false;
    const Matrix3d inertia = body.rotation * body.inertia * body.rotation.transpose();
    const Vector3d torque = body.torque + GyroscopicTorque(inertia, body.angular, step_);
    node.arm.setZero();
    if (body.parent >= 0) {
      const Body& parent = bodies_[static_cast<size_t>(body.parent)];
      const Vector3d parent_arm = parent.rotation * body.parent_anchor;
      node.arm = body.rotation * body.anchor;
      node.axis = body.rotation * body.axis;
      node.p = node.axis.unitOrthogonal();
      node.q = node.axis.cross(node.p);
      node.from_parent = parent_arm - nodes_[static_cast<size_t>(body.parent)].arm;
      const Vector3d relative = body.angular - parent.angular;
      const double along = node.axis.dot(relative);
      node.drive.head<3>() = pull_ * (parent_arm + parent.position - node.arm - body.position) -
                             (body.linear + body.angular.cross(node.arm) - parent.linear -
                              parent.angular.cross(parent_arm));
      node.drive.tail<3>() = pull_ * node.axis.cross(parent.rotation * body.parent_axis) -
                             (relative - along * node.axis);
      if (body.motor) node.drive.tail<3>() += (body.motor_velocity - along) * node.axis;
    }
    const Matrix3d across = -body.mass * Cross(node.arm);  // the COM is at -arm
    node.inertia.topLeftCorner<3, 3>() = body.mass * Matrix3d::Identity();
    node.inertia.bottomLeftCorner<3, 3>() = across;
    node.inertia.topRightCorner<3, 3>() = across.transpose();
    node.inertia.bottomRightCorner<3, 3>() = inertia + across * Cross(node.arm);
    node.outside.head<3>() = step_ * body.force;
    node.outside.tail<3>() = step_ * (torque - node.arm.cross(body.force));
    node.impulse = node.outside;
  }
}

// Takes the joint's rows out, one after the other: a row of compliance e in direction d turns the
// inertia I that it passes on into I - I d dᵀ I / (1 / e + dᵀ I d). Nothing is subtracted that is
// nearly equal but for a free motor row, whose direction then passes nothing.
void TreeStep::Eliminate(size_t i) {
  const Body& body = bodies_[i];
  Node& node = nodes_[i];
  Matrix6d& inertia = node.inertia;
  const double stiffness = 1 / cfm_;
  for (int k = 0; k < 3; ++k) {
    const Vector6d column = inertia.col(k);
    node.lose[static_cast<size_t>(k)] = column / (stiffness + column[k]);
    inertia.noalias() -= node.lose[static_cast<size_t>(k)] * column.transpose();
  }
  for (size_t k = 3; k < 6; ++k) {
    const Vector3d& direction = k == 3 ? node.p : k == 4 ? node.q : node.axis;
    const Vector6d column = inertia.rightCols<3>() * direction;
    const double hold = k < 5 ? stiffness : body.motor ? step_ / body.motor_cfm : 0;
    const double gain = 1 / (hold + direction.dot(column.tail<3>()));
    node.lose[k] = gain * column;
    inertia.noalias() -= node.lose[k] * column.transpose();
    if (k < 5) continue;
    node.motor_column = column;
    node.motor_gain = gain;
  }
  const Vector3d& d = node.from_parent;
  const Matrix3d cross = Cross(d);
  Matrix6d& to = nodes_[static_cast<size_t>(body.parent)].inertia;
  const Matrix3d linear = inertia.topLeftCorner<3, 3>();
  const Matrix3d mixed = inertia.topRightCorner<3, 3>();
  const Matrix3d moved = mixed - linear * cross;
  to.topLeftCorner<3, 3>() += linear;
  to.topRightCorner<3, 3>() += moved;
  to.bottomLeftCorner<3, 3>() += moved.transpose();
  to.bottomRightCorner<3, 3>() +=
      inertia.bottomRightCorner<3, 3>() + cross * moved - mixed.transpose() * cross;
}

void TreeStep::PassImpulse(size_t i) {
  Node& node = nodes_[i];
  Vector6d passed = node.impulse;
  for (int k = 0; k < 3; ++k) passed -= node.lose[static_cast<size_t>(k)] * passed[k];
  passed -= node.lose[3] * node.p.dot(passed.tail<3>());
  passed -= node.lose[4] * node.q.dot(passed.tail<3>());
  node.motor_impulse = node.axis.dot(passed.tail<3>());
  passed -= node.lose[5] * node.motor_impulse;
  node.passed = passed;
  const Vector6d felt = passed - node.inertia * node.drive;
  Vector6d& to = nodes_[static_cast<size_t>(bodies_[i].parent)].impulse;
  to.head<3>() += felt.head<3>();
  to.tail<3>() += felt.tail<3>() + node.from_parent.cross(felt.head<3>());
}

void TreeStep::Accelerate(bool paths_only) {
  nodes_[0].change = base_.solve(nodes_[0].impulse);
  for (size_t i = 1; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    if (paths_only && !node.on_path) continue;
    const Vector6d& parent = nodes_[static_cast<size_t>(bodies_[i].parent)].change;
    Vector6d wanted = parent + node.drive;
    wanted.head<3>() += parent.tail<3>().cross(node.from_parent);
    const Vector6d impulse = node.inertia * wanted - node.passed;  // of the joint
    node.change = wanted - cfm_ * impulse;
    const double along = node.axis.dot(wanted.tail<3>()) -
                         node.motor_gain * (node.motor_column.dot(wanted) - node.motor_impulse);
    node.change.tail<3>() += (along - node.axis.dot(node.change.tail<3>())) * node.axis;
  }
}

void TreeStep::FindResponses(std::span<const Contact> contacts) {
  contact_bodies_.clear();
  for (const Contact& contact : contacts) {
    if (std::ranges::find(contact_bodies_, contact.body) != contact_bodies_.end()) continue;
    contact_bodies_.push_back(contact.body);
    for (int i = contact.body; i >= 0; i = bodies_[static_cast<size_t>(i)].parent) {
      nodes_[static_cast<size_t>(i)].on_path = true;
    }
  }
  nodes_[0].response = base_.solve(Matrix6d::Identity());
  for (size_t i = 1; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    if (!node.on_path) continue;
    const Vector3d& a = node.axis;
    const Vector6d motor = node.motor_gain * node.motor_column;
    // E A, and below without its part along the motor's axis, which is motorᵀ.
    Matrix6d give = cfm_ * node.inertia;
    give.bottomRows<3>() -= a * (a.transpose() * give.bottomRows<3>()).eval();
    // yield = E - E A E, E = diag(cfm, cfm, cfm, cfm (1 - a aᵀ) + a aᵀ / hold).
    Matrix6d& yield = node.yield;
    yield = -cfm_ * give;
    yield.rightCols<3>() -= (yield.rightCols<3>() * a).eval() * a.transpose();
    Vector6d across = cfm_ * motor;
    across.tail<3>() -= a.dot(across.tail<3>()) * a;
    yield.bottomRows<3>() -= a * across.transpose();
    yield.rightCols<3>() -= across * a.transpose();
    yield.bottomRightCorner<3, 3>() += (node.motor_gain - cfm_) * a * a.transpose();
    yield.diagonal().array() += cfm_;
    Matrix6d follow = -give;
    follow.bottomRows<3>() -= a * motor.transpose();
    follow.diagonal().array() += 1;
    follow.rightCols<3>() -= (follow.leftCols<3>() * Cross(node.from_parent)).eval();
    node.follow = follow;
    const Matrix6d& parent = nodes_[static_cast<size_t>(bodies_[i].parent)].response;
    const Matrix6d moved = follow.lazyProduct(parent);
    node.response = moved.lazyProduct(follow.transpose()) + yield;
  }
}

// Returns how the velocity of a responds to an impulse on b.
TreeStep::Matrix6d TreeStep::CrossResponse(size_t a, size_t b) const {
  Matrix6d to_a = Matrix6d::Identity(), to_b = Matrix6d::Identity();
  while (a != b) {  // parents have the lower index
    if (a > b) {
      to_a = to_a.lazyProduct(nodes_[a].follow).eval();
      a = static_cast<size_t>(bodies_[a].parent);
    } else {
      to_b = to_b.lazyProduct(nodes_[b].follow).eval();
      b = static_cast<size_t>(bodies_[b].parent);
    }
  }
  const Matrix6d moved = to_a.lazyProduct(nodes_[a].response);
  return moved.lazyProduct(to_b.transpose());
}

std::optional<double> TreeStep::SolveFriction(std::span<const Contact> contacts, Index rows,
                                              int round) {
  Index row = 0;
  for (size_t c = 0; c < contacts.size(); ++c) {
    const double most = contacts[c].friction * normal_impulses_[static_cast<Index>(c)];
    for (int k = 0; k < RowsOf(contacts[c]); ++k, ++row) {
      lower_[row] = k == 0 ? 0 : -most;
      upper_[row] = k == 0 ? std::numeric_limits<double>::infinity() : most;
    }
  }
  if (!all_.Solve(system_.topLeftCorner(rows, rows), wanted_.head(rows), lower_.head(rows),
                  upper_.head(rows), impulses_.head(rows))) {
    return {};
  }
  double load = 0, moved = 0;
  row = 0;
  for (size_t c = 0; c < contacts.size(); ++c) {
    const double normal = impulses_[row];
    double& assumed = normal_impulses_[static_cast<Index>(c)];
    bool met = false;  // a bound, or what it should have been
    for (int k = 1; k < RowsOf(contacts[c]); ++k) {
      const double along = std::abs(impulses_[row + k]);
      met = met || along >= upper_[row + k] || along > contacts[c].friction * normal;
    }
    load += normal;
    if (met) moved += std::abs(normal - assumed);
    // Half the way ends what would go to and fro.
    assumed += (round < kWholeRounds ? 1 : 0.5) * (normal - assumed);
    row += RowsOf(contacts[c]);
  }
  return load > 0 ? moved / load : 0;
}

bool TreeStep::SolveContacts(std::span<const Contact> contacts) {
  normal_.clear();
  Index n = 0, normals = 0;
  for (const Contact& contact : contacts) {
    const auto b = static_cast<size_t>(contact.body);
    const Body& body = bodies_[b];
    const Vector3d arm = contact.position - body.position - nodes_[b].arm;
    Vector6d velocity = nodes_[b].change;
    velocity.head<3>() += body.linear + body.angular.cross(nodes_[b].arm);
    velocity.tail<3>() += body.angular;
    const auto normal = static_cast<int>(n);
    for (int k = 0; k < RowsOf(contact); ++k, ++n) {
      const Vector3d& direction = contact.directions[static_cast<size_t>(k)];
      rows_.row(n) << direction.transpose(), arm.cross(direction).transpose();
      wanted_[n] = (k == 0 ? contact.velocity : 0) - rows_.row(n).dot(velocity);
      normal_.push_back(k == 0 ? -1 : normal);
    }
    ++normals;
  }
  for (const int b : contact_bodies_) {
    Index row = 0;
    for (const int a : contact_bodies_) {
      if (a < b) continue;
      const auto i = static_cast<size_t>(a), j = static_cast<size_t>(b);
      const Matrix6d response = i == j ? nodes_[i].response : CrossResponse(i, j);
      row = 0;
      for (const Contact& at : contacts) {
        const int count = RowsOf(at);
        if (at.body == a) {
          moved_.middleRows(row, count).noalias() =
              rows_.middleRows(row, count).lazyProduct(response);
          Index column = 0;
          for (const Contact& from : contacts) {
            const int width = RowsOf(from);
            if (from.body == b) {
              for (int r = 0; r < count; ++r) {
                for (int c = 0; c < width; ++c) {
                  const double value = moved_.row(row + r).dot(rows_.row(column + c));
                  system_(row + r, column + c) = value;
                  system_(column + c, row + r) = value;
                }
              }
            }
            column += width;
          }
        }
        row += count;
      }
    }
  }
  Index normal_row = 0, row = 0;
  for (const Contact& contact : contacts) {
    system_(row, row) += contact.cfm / step_;
    for (int k = 1; k < RowsOf(contact); ++k) system_(row + k, row + k) += cfm_;
    Index normal_column = 0, column = 0;
    for (const Contact& other : contacts) {
      normal_system_(normal_row, normal_column++) = system_(row, column);
      column += RowsOf(other);
    }
    normal_wanted_[normal_row++] = wanted_[row];
    row += RowsOf(contact);
  }
  if (!normals_.Solve(normal_system_.topLeftCorner(normals, normals), normal_wanted_.head(normals),
                      zero_.head(normals), infinite_.head(normals),
                      normal_impulses_.head(normals))) {
    return false;
  }
  for (std::optional<double> off = 1; friction_rounds_<kMostRounds&& * off> kBoundsOff;
       ++friction_rounds_) {
    off = SolveFriction(contacts, n, friction_rounds_);
    if (!off) return false;
  }
  for (size_t i = 0; i < nodes_.size(); ++i) nodes_[i].impulse = nodes_[i].outside;
  row = 0;
  for (size_t c = 0; c < contacts.size(); ++c) {
    Vector3d impulse = Vector3d::Zero();
    Vector6d& to = nodes_[static_cast<size_t>(contacts[c].body)].impulse;
    for (int k = 0; k < RowsOf(contacts[c]); ++k, ++row) {
      impulse += impulses_[row] * contacts[c].directions[static_cast<size_t>(k)];
      to += impulses_[row] * rows_.row(row).transpose();
    }
    forces_[c] = impulse / step_;
  }
  return true;
}

bool TreeStep::Solve(std::span<const Contact> contacts) {
  Prepare();
  for (size_t i = nodes_.size(); i-- > 1;) {
    Eliminate(i);
    PassImpulse(i);
  }
  base_.compute(nodes_[0].inertia);
  if (base_.info() != Eigen::Success) return false;
  friction_rounds_ = 0;
  if (!contacts.empty()) {
    FindResponses(contacts);
    Accelerate(true);
    if (!SolveContacts(contacts)) return false;
    for (size_t i = nodes_.size(); i-- > 1;) PassImpulse(i);
  }
  Accelerate(false);
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const Vector6d& change = nodes_[i].change;
    bodies_[i].linear += change.head<3>() - change.tail<3>().cross(nodes_[i].arm);
    bodies_[i].angular += change.tail<3>();
  }
  return true;
}

}  // namespace poise
