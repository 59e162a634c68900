#include "tools/sweep/step_ladder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "components/robot/posture.h"
#include "components/step_planner/recovery_config.h"
#include "components/step_planner/stepping/point_mass.h"

namespace poise {
namespace {

using Eigen::Vector2d;

// After as many steps what one more adds is below a thousandth of the first.
constexpr int kMostSteps = 12;
constexpr double kBeyondReach = 10;  // m

/// m, of the polygon's farthest point along `direction`.
double Farthest(const balance::ConvexPolygon& polygon, const Vector2d& direction) {
  double farthest = -std::numeric_limits<double>::infinity();
  for (const Vector2d& corner : polygon.corners()) {
    farthest = std::max(farthest, direction.dot(corner));
  }
  return farthest;
}

/// m along `direction`, from the sole that stands to the farthest that `foot` reaches, the COM as
/// far as the stance leg, and its sole that rolls over its edge, let it go.
double StepLength(const stepping::Reach& reach, robot::Foot foot, const Vector2d& direction) {
  using stepping::Crossing;
  double longest = -std::numeric_limits<double>::infinity();
  for (const Crossing crossing : {Crossing::kNone, Crossing::kInFront, Crossing::kBehind}) {
    const balance::ConvexPolygon footholds =
        reach.Footholds(foot, kBeyondReach * direction, crossing);
    longest = std::max(longest, Farthest(footholds, direction));
  }
  return longest;
}

}  // namespace

StepLadder::StepLadder(const robot::RobotModel& model)
    : model_(model),
      recovery_(
          MakeRecovery(RecoveryConfig(), ContactConfirmation(), model, /*watched_margin=*/-1)) {}

double StepLadder::impulse_scale() const {
  return model_.total_mass() * std::sqrt(robot::kGravity * robot::StandingHeight(model_));
}

double StepLadder::Bound(const Vector2d& direction) const {
  const stepping::StepChoice& choice = recovery_.choice();
  const double frequency = std::sqrt(robot::kGravity / robot::StandingHeight(model_));
  const stepping::StepLimits& limits = choice.limits();
  const stepping::PointMass standing(model_, recovery_);
  const double edge = Farthest(standing.Soles(0), direction);
  double best = 0;
  for (const robot::Foot first : robot::kFeet) {
    double caught = 0, time = limits.unload;
    robot::Foot foot = first;
    for (int k = 0; k < kMostSteps; ++k, foot = robot::Other(foot)) {
      time += limits.least_swing;
      caught += StepLength(choice.reach(), foot, direction) * std::exp(-frequency * time);
      best = std::max(best, caught);
    }
  }
  return model_.total_mass() * frequency * (edge + best);
}

bool StepLadder::Survives(const PushProfile& push, double period, double duration) const {
  stepping::PointMass robot(model_, recovery_);
  const auto ticks = static_cast<int64_t>(std::ceil(duration / period));
  for (int64_t k = 0; k < ticks && !robot.fallen(); ++k) {
    const double time = static_cast<double>(k) * period;
    robot.Tick(period, push.MeanForce(time, time + period).head<2>());
  }
  return !robot.fallen();
}

}  // namespace poise
