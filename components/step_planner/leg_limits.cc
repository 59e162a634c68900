#include "components/step_planner/leg_limits.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <functional>

#include "components/framework/configuration/configuration.h"
#include "components/robot/posture.h"

namespace poise {
namespace {

using Eigen::Vector2d;

constexpr double kFarthest = 3;  // m: no two legs span more
constexpr int kHalvings = 12;    // to a millimetre of that

/// The largest value up to `most` that holds, where those above it do not.
double Largest(double most, const std::function<bool(double)>& holds) {
  double low = 0, high = most;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
  }
  return low;
}

bool Raises(const robot::RobotModel& model, double clearance) {
  for (size_t foot = 0; foot < 2; ++foot) {
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

}  // namespace

double WidestStance(const stepping::Reach& reach) {
  return Largest(kFarthest, [&](double width) {
    return reach.LoweringShare({Vector2d(0, -0.5 * width), Vector2d(0, 0.5 * width)}) <= 1;
  });
}

double WidestSpacing(const stepping::Reach& reach) {
  const Vector2d here = Vector2d::Zero();
  return Largest(kFarthest, [&](double width) {
    return reach.LoweringShare({here, Vector2d(0, width)}) <= 1 &&
           reach.LoweringShare({Vector2d(0, -width), here}) <= 1;
  });
}

double LongestStride(const stepping::Reach& reach, double spacing) {
  return Largest(kFarthest, [&](double length) {
    const Vector2d half(0.5 * length, 0.5 * spacing);
    return reach.LoweringShare({Vector2d(-half), half}) <= 1 &&
           reach.LoweringShare({Vector2d(half.x(), -half.y()), Vector2d(-half.x(), half.y())}) <= 1;
  });
}

void CheckGap(const std::string& part, double gap, const robot::RobotModel& model,
              const stepping::Reach& reach) {
  const double widest = WidestSpacing(reach);
  if (reach.least_spacing() <= widest) return;
  const double most = widest - (reach.least_spacing() - gap);
  if (most <= 0) {
    throw ConfigError(part + ".gap",
                      fmt::format("is {} m; robot '{}' stands on one foot with the other {:.3f} m "
                                  "beside it at most, and its soles are {:.3f} m wide: give less "
                                  "joint_reserve, or less reach_lower",
                                  gap, model.name(), widest, reach.least_spacing() - gap));
  }
  throw ConfigError(part + ".gap",
                    fmt::format("is {} m; robot '{}' cannot stand on one foot with the other "
                                "so far beside it: give 0 to {:.3f} m",
                                gap, model.name(), most));
}

void CheckClearance(const std::string& part, double clearance, const robot::RobotModel& model) {
  if (Raises(model, clearance)) return;
  const double most = Largest(clearance, [&](double c) { return Raises(model, c); });
  throw ConfigError(part + ".clearance",
                    fmt::format("is {} m; the legs of robot '{}' raise a sole by {:.3f} m at most: "
                                "give less",
                                clearance, model.name(), most));
}

}  // namespace poise
