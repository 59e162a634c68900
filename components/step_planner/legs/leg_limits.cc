#include "components/step_planner/legs/leg_limits.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

#include "components/framework/configuration/configuration.h"
#include "components/robot/dynamics.h"
#include "components/robot/posture.h"

namespace poise {
namespace {

using Eigen::Vector2d;

constexpr double kFarthest = 3;  // m: no two legs span more
constexpr int kHalvings = 12;    // to a millimetre of that
// Share of a joint's torque with which it may hold the robot on one leg: what a step adds takes the
// rest. Fitted to iCub, whose knees are weak: it walks with 0.55 to 0.65, stamps with less, falls
// with 0.7.
constexpr double kHoldingShare = 0.6;
constexpr double kMoreThanStanding = 1.1;  // ratio, of a joint that has more than that as it stands

/// The largest value up to `most` that holds, where those above it do not.
double Largest(double most, const std::function<bool(double)>& holds) {
  double low = 0, high = most;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
  }
  return low;
}

/// How far a polygon goes to a side, `sign` along y, at x = 0.
double Sideways(const balance::ConvexPolygon& polygon, double sign) {
  const std::span<const Vector2d> corners = polygon.corners();
  double farthest = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vector2d &a = corners[i], &b = corners[(i + 1) % corners.size()];
    if (a.x() == b.x() || (a.x() > 0) == (b.x() > 0)) continue;
    const double y = a.y() - a.x() * (b.y() - a.y()) / (b.x() - a.x());
    farthest = std::max(farthest, sign * y);
  }
  return farthest;
}

bool Raises(const robot::RobotModel& model, double clearance) {
  for (const robot::Foot foot : robot::kFeet) {
    robot::PostureGoal goal = robot::StandingGoal(model);
    goal.foot[foot].translation().z() += clearance;
    try {
      robot::SolvePosture(model, goal);
    } catch (const robot::RobotError&) {
      return false;
    }
  }
  return true;
}

/// What each joint of the leg needs of its torque, as a share, while `foot` alone holds the robot,
/// the COM above it, `lowering` m lower than standing; 0 where there is no such posture.
Eigen::VectorXd HoldingShares(const robot::RobotModel& model, robot::Foot foot, double lowering) {
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(model.num_joints());
  robot::PostureGoal goal = robot::StandingGoal(model);
  goal.com_xy = goal.foot[foot].translation().head<2>();
  goal.com_height -= lowering;
  robot::RobotState state;
  try {
    state = robot::SolvePosture(model, goal);
  } catch (const robot::RobotError&) {
    return shares;
  }
  const robot::RobotData data = robot::Evaluate(model, state);
  const auto& jacobian = data.foot_jacobian[foot];
  const robot::Vector6d wrench =
      jacobian.leftCols<6>().transpose().partialPivLu().solve(data.gravity.head<6>());
  const Eigen::VectorXd peak = robot::PeakTorques(model);
  for (const int j : model.supporting_joints(model.feet()[foot].body)) {
    const double torque = data.gravity[6 + j] - jacobian.col(6 + j).dot(wrench);
    shares[j] = std::abs(torque) / peak[j];
  }
  return shares;
}

}  // namespace

double WidestStance(const stepping::Reach& reach) {
  return Largest(kFarthest, [&](double width) {
    return reach.LoweringShare({Vector2d(0, -0.5 * width), Vector2d(0, 0.5 * width)}) <= 1;
  });
}

double WidestSpacing(const stepping::Reach& reach) {
  double widest = kFarthest;
  for (const robot::Foot foot : robot::kFeet) {
    double reached = 0;
    for (const double share : {0.0, 1.0}) {
      reached = std::max(reached, Sideways(reach.Leg(foot, share), robot::Side(foot)));
    }
    widest = std::min(widest, reached);
  }
  return widest;
}

double LongestStride(const stepping::Reach& reach, double spacing) {
  return Largest(kFarthest, [&](double length) {
    const Vector2d half(0.5 * length, 0.5 * spacing);
    return reach.LoweringShare({Vector2d(-half), half}) <= 1 &&
           reach.LoweringShare({Vector2d(half.x(), -half.y()), Vector2d(-half.x(), half.y())}) <= 1;
  });
}

double MostLowering(const robot::RobotModel& model, double wanted) {
  // A joint that needs more of its torque anyway, as a hip that holds the other leg, is no reason.
  robot::FootArray<Eigen::VectorXd> most;
  for (const robot::Foot foot : robot::kFeet) {
    const Eigen::VectorXd standing = HoldingShares(model, foot, 0);
    most[foot] = (standing.array() * kMoreThanStanding).max(kHoldingShare);
  }
  const auto holds = [&](double lowering) {
    return std::ranges::all_of(robot::kFeet, [&](robot::Foot foot) {
      return (HoldingShares(model, foot, lowering).array() <= most[foot].array()).all();
    });
  };
  return holds(wanted) ? wanted : Largest(wanted, holds);
}

void CheckGap(double gap, const robot::RobotModel& model, const stepping::Reach& reach) {
  const double widest = WidestSpacing(reach);
  if (reach.least_spacing() <= widest) return;
  const double most = widest - (reach.least_spacing() - gap);
  if (most <= 0) {
    throw ConfigError(
        "walk.gap", fmt::format("is {} m; robot '{}' brings a foot down {:.3f} m beside its COM at "
                                "most, and its soles are {:.3f} m wide: there is no gap that its "
                                "legs allow; look at their joints' limits in its file",
                                gap, model.name(), widest, reach.least_spacing() - gap));
  }
  throw ConfigError("walk.gap",
                    fmt::format("is {} m; robot '{}', standing on one foot, cannot bring the other "
                                "down so far beside it: give 0 to {:.3f} m",
                                gap, model.name(), most));
}

void CheckStanceLegs(double distance, const robot::RobotModel& model, const stepping::Reach& reach,
                     double height) {
  double beside = 0;
  for (const robot::Foot foot : robot::kFeet) beside = std::max(beside, reach.BesideCom(foot));
  if (beside <= distance) return;
  std::string joints;
  for (const stepping::JointAt& at : stepping::JointsBelowCom(model, height)) {
    const robot::Joint& joint = model.joints()[static_cast<size_t>(at.joint)];
    joints +=
        fmt::format("{}{} would be at {:.3f} of {:.3f} to {:.3f} rad", joints.empty() ? "" : ", ",
                    joint.name, at.position, joint.lower, joint.upper);
  }
  throw ConfigError(
      "walk.quasi_static",
      fmt::format("is true: the robot stands on one foot with its COM above the middle of that "
                  "sole. Robot '{}' comes within {:.3f} m of that, and {:.3f} m would do{}{}, and "
                  "{} rad are kept off each limit. Give false: it walks as on level ground then, "
                  "and unknown "
                  "ground is not for it",
                  model.name(), beside, distance, joints.empty() ? "" : ": ", joints,
                  stepping::Reach::kJointReserve));
}

void CheckClearance(double clearance, const robot::RobotModel& model) {
  if (Raises(model, clearance)) return;
  const double most = Largest(clearance, [&](double c) { return Raises(model, c); });
  throw ConfigError("walk.clearance",
                    fmt::format("is {} m; the legs of robot '{}' raise a sole by {:.3f} m at most: "
                                "give less",
                                clearance, model.name(), most));
}

}  // namespace poise
