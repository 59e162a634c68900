#include "components/step_planner/legs/reach.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "components/balance/support_polygon.h"
#include "components/robot/dynamics.h"
#include "components/robot/posture.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kDirections = 12;       // corners of a leg's polygon
constexpr double kSearchStep = 0.05;  // m, of the search along a direction
constexpr double kFinest = 0.004;     // m, to which the edge is found
constexpr double kFarthest = 2;       // m: no leg is longer
// Share of the way to the edge that counts as reached: a straight leg moves the sole no more.
constexpr double kOfStraight = 0.97;
constexpr int kMaxIterations = 15;
constexpr double kTolerance = 1e-6;  // m, rad
constexpr double kDamping = 1e-8;
constexpr double kMaxTurn = 0.3;  // rad, of a joint in one iteration

/// One leg by Newton's method; body and other leg stay.
class Leg {
 public:
  Leg(const robot::RobotModel& model, const robot::RobotState& standing, Foot foot)
      : model_(model), data_(model), state_(standing), foot_(foot) {
    const auto joints = model.supporting_joints(model.feet()[foot_].body);
    joints_.assign(joints.begin(), joints.end());
    Evaluate();
    level_ = data_.foot_pose[foot_].linear();
  }

  Vector3d sole() const { return data_.foot_pose[foot_].translation(); }
  /// Returns the COM's position, m, world.
  Vector3d Com() {
    Vector3d sum = Vector3d::Zero();
    for (size_t b = 0; b < model_.bodies().size(); ++b) {
      const robot::Body& body = model_.bodies()[b];
      sum += body.mass *
             (data_.base_position + data_.body_position[b] + data_.body_rotation[b] * body.com);
    }
    return sum / model_.total_mass();
  }
  /// Where the sole stands level at `target`, m, world, whatever the joints' limits: the joints
  /// that are too near to them. Empty, too, where no position of the joints brings it there.
  std::vector<JointAt> NearLimits(const Vector3d& target) {
    std::vector<JointAt> near;
    if (!Solve(target)) return near;
    for (const int j : joints_) {
      if (!Within(j)) near.push_back({j, state_.joint_position[j]});
    }
    return near;
  }
  /// False, and the leg as it was, when the sole cannot stand level at `target`, m, world.
  bool Reach(const Vector3d& target) {
    const Eigen::VectorXd before = state_.joint_position;
    const bool reached = Solve(target) && WithinLimits();
    if (!reached) {
      state_.joint_position = before;
      Evaluate();
    }
    return reached;
  }

 private:
  void Evaluate() {
    robot::ComputeKinematics(model_, state_, &data_);
    robot::ComputeFeet(model_, &data_);
  }
  bool Solve(const Vector3d& target) {
    const auto k = static_cast<Eigen::Index>(joints_.size());
    Eigen::MatrixXd jacobian(6, k);
    for (int i = 0; i < kMaxIterations; ++i) {
      const Eigen::AngleAxisd turn(level_ * data_.foot_pose[foot_].linear().transpose());
      robot::Vector6d error;
      error << target - sole(), turn.angle() * turn.axis();
      if (error.lpNorm<Eigen::Infinity>() < kTolerance) return true;
      for (Eigen::Index j = 0; j < k; ++j) {
        jacobian.col(j) = data_.foot_jacobian[foot_].col(6 + joints_[static_cast<size_t>(j)]);
      }
      Eigen::Matrix<double, 6, 6> gram = jacobian * jacobian.transpose();
      gram.diagonal().array() += kDamping;
      Eigen::VectorXd step = jacobian.transpose() * gram.ldlt().solve(error);
      const double largest = step.lpNorm<Eigen::Infinity>();
      if (!std::isfinite(largest)) return false;
      if (largest > kMaxTurn) step *= kMaxTurn / largest;
      for (Eigen::Index j = 0; j < k; ++j) {
        state_.joint_position[joints_[static_cast<size_t>(j)]] += step[j];
      }
      Evaluate();
    }
    return false;
  }
  bool Within(int j) const {
    const robot::Joint& joint = model_.joints()[static_cast<size_t>(j)];
    const double q = state_.joint_position[j];
    return q >= joint.lower + Reach::kJointReserve && q <= joint.upper - Reach::kJointReserve;
  }
  bool WithinLimits() const {
    return std::ranges::all_of(joints_, [&](int j) { return Within(j); });
  }

  const robot::RobotModel& model_;
  robot::RobotData data_;
  robot::RobotState state_;
  Foot foot_;
  std::vector<int> joints_;
  Eigen::Matrix3d level_;
};

/// The stance with its COM `height` m high; empty: the robot does not stand so.
std::optional<robot::RobotState> Standing(const robot::RobotModel& model, double height) {
  robot::PostureGoal goal = robot::StandingGoal(model);
  goal.com_height = height;
  try {
    return robot::SolvePosture(model, goal);
  } catch (const robot::RobotError&) {
    return {};
  }
}

/// Returns where `foot` reaches from the COM, from the stance outwards; empty when the stance
/// cannot be held.
balance::ConvexPolygon LegPolygon(const robot::RobotModel& model, double height, Foot foot) {
  const std::optional<robot::RobotState> standing = Standing(model, height);
  if (!standing) return {};
  std::array<Vector2d, kDirections> edge;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * std::numbers::pi * i / kDirections;
    const Vector3d direction(std::cos(angle), std::sin(angle), 0);
    Leg leg(model, *standing, foot);
    const Vector3d start = leg.sole();
    double reached = 0, stride = kSearchStep;
    while (stride > kFinest && reached < kFarthest) {
      if (leg.Reach(start + (reached + stride) * direction)) {
        reached += stride;
      } else {
        stride *= 0.5;
      }
    }
    edge[static_cast<size_t>(i)] =
        (start + kOfStraight * (leg.sole() - start) - leg.Com()).head<2>();
  }
  return balance::ConvexHull(edge);
}

Eigen::Rotation2Dd Turn(double yaw) { return Eigen::Rotation2Dd(yaw); }

}  // namespace

balance::ConvexPolygon SoleAt(const robot::FootModel& foot, double margin, const Vector2d& centre,
                              double yaw) {
  balance::ConvexPolygon sole = balance::SolePolygon(foot, margin);
  const Eigen::Matrix2d turn = Turn(yaw).toRotationMatrix();
  for (Vector2d& corner : sole.mutable_corners()) corner = centre + turn * corner;
  return sole;
}

balance::ConvexPolygon HullOf(const balance::ConvexPolygon& a, const balance::ConvexPolygon& b) {
  std::array<Vector2d, balance::ConvexPolygon::kMaxCorners> points;
  size_t count = 0;
  for (const balance::ConvexPolygon* polygon : {&a, &b}) {
    for (const Vector2d& corner : polygon->corners()) {
      if (count < points.size()) points[count++] = corner;
    }
  }
  return balance::ConvexHull({points.data(), count});
}

Reach::Reach(const robot::RobotModel& model, double height, double lowering, double gap)
    : lowering_(lowering) {
  for (const Foot foot : kFeet) {
    auto& leg = leg_[foot];
    leg[0] = LegPolygon(model, height, foot);
    leg[1] = LegPolygon(model, height - lowering, foot);
  }
  least_spacing_ = 0.5 * (model.feet()[0].width + model.feet()[1].width) + gap;
  double front = 0, rear = 0;
  for (const robot::FootModel& foot : model.feet()) {
    roll_ = std::max(roll_, foot.length);
    const balance::ConvexPolygon sole = balance::SolePolygon(foot, 0);
    for (const Vector2d& corner : sole.corners()) {
      front = std::max(front, corner.x());
      rear = std::max(rear, -corner.x());
    }
  }
  least_ahead_ = front + rear + gap;
}

balance::ConvexPolygon Reach::Leg(Foot foot, double share) const {
  const auto& leg = leg_[foot];
  share = std::clamp(share, 0.0, 1.0);
  // Between two convex sets that are cut along the same directions.
  if (leg[0].num_corners != leg[1].num_corners) return leg[share < 1 ? 0 : 1];
  balance::ConvexPolygon between = leg[0];
  for (size_t i = 0; i < between.corners().size(); ++i) {
    between.corner[i] += share * (leg[1].corner[i] - leg[0].corner[i]);
  }
  return between;
}

double Reach::LoweringShare(const FootArray<Vector2d>& offset) const {
  double share = 0;
  for (const Foot i : kFeet) {
    const double high = balance::SignedDistance(leg_[i][0], offset[i]);
    if (high >= 0) continue;
    const double low = balance::SignedDistance(leg_[i][1], offset[i]);
    share = std::max(share, low > 0 ? -high / (low - high) : 1 - low);
  }
  return share;
}

double Reach::UsefulLowering(const FootArray<Vector2d>& offset) const {
  double share = 0;
  for (const Foot i : kFeet) {
    const double high = balance::SignedDistance(leg_[i][0], offset[i]);
    const double low = balance::SignedDistance(leg_[i][1], offset[i]);
    if (high >= 0 || low <= high) continue;
    share = std::max(share, low > 0 ? -high / (low - high) : 1);
  }
  return share;
}

double Reach::BesideCom(Foot stance) const {
  double inside = -kFarthest;
  for (const balance::ConvexPolygon& leg : leg_[stance]) {
    if (leg.num_corners >= 3) {
      inside = std::max(inside, balance::SignedDistance(leg, Vector2d::Zero()));
    }
  }
  return std::max(0.0, -inside);
}

Vector2d Reach::ComAbove(Foot stance, const Vector2d& com, double share) const {
  const balance::ConvexPolygon leg = Leg(stance, share);
  if (leg.num_corners == 0) return com;
  const Vector2d nearest = -balance::NearestPoint(leg, -com);
  const double excess = (com - nearest).norm();
  return excess > roll_ ? Vector2d(nearest + roll_ / excess * (com - nearest)) : com;
}

balance::ConvexPolygon Reach::Footholds(Foot foot, const Vector2d& com, Crossing crossing,
                                        double share) const {
  const Vector2d above = ComAbove(Other(foot), com, share);
  balance::ConvexPolygon reached = Leg(foot, share);
  for (Vector2d& corner : reached.mutable_corners()) corner += above;
  if (crossing == Crossing::kInFront) return balance::Clip(reached, {{-1, 0}, -least_ahead_});
  if (crossing == Crossing::kBehind) return balance::Clip(reached, {{1, 0}, -least_ahead_});
  const double side = Side(foot);
  return balance::Clip(reached, {{0, -side}, -least_spacing_});
}

std::vector<JointAt> JointsBelowCom(const robot::RobotModel& model, double height) {
  std::vector<JointAt> joints;
  const std::optional<robot::RobotState> standing = Standing(model, height);
  if (!standing) return joints;
  for (const Foot foot : kFeet) {
    Leg leg(model, *standing, foot);
    const Vector3d com = leg.Com();
    const std::vector<JointAt> near = leg.NearLimits({com.x(), com.y(), leg.sole().z()});
    joints.insert(joints.end(), near.begin(), near.end());
  }
  return joints;
}

}  // namespace poise::stepping
