#include "tools/scenario/push_bound.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "components/messages/conversions.h"
#include "components/robot/sole.h"
#include "components/step_planner/recovery_config.h"
#include "components/step_planner/stepping/pendulum.h"
#include "logging/metrics/metrics.h"
#include "sim/push.h"
#include "sim/simulated_robot.h"
#include "sim/start_posture.h"
#include "tools/scenario/step_reach.h"

namespace poise {

using Eigen::Vector2d;
using std::numbers::pi;

double PendulumShare(Push::Profile profile, double duration, double frequency) {
  const double wt = frequency * duration;
  if (wt < 1e-9) return 1;
  if (profile == Push::RECTANGLE) return -std::expm1(-wt) / wt;
  return pi * pi * (1 + std::exp(-wt)) / (2 * (wt * wt + pi * pi));
}

namespace {

/// N·s; `impulse_scale`: ImpulseScale (N·s), of which scaled_impulse is a share.
double HorizontalImpulse(const Push& push, double impulse_scale) {
  const double horizontal = std::hypot(push.direction_x(), push.direction_y());
  const double all = std::hypot(horizontal, push.direction_z());
  if (!(all > 0)) return 0;
  const double impulse = push.has_scaled_impulse()
                             ? std::abs(push.scaled_impulse()) * impulse_scale
                             : std::abs(push.peak()) * MeanOfPeak(push.profile()) * push.duration();
  return impulse * horizontal / all;
}

/// s from the push's begin to the first step's touch-down; empty: there was none.
std::optional<double> StepTime(const Scenario& scenario, const logging::RunRecord& run) {
  if (!scenario.step_planner().recovery().enabled()) return {};
  return logging::FindMetric("step_touch_down")->compute(run);
}

std::optional<PushBound> BoundOf(const Push& push, const Scenario& scenario,
                                 const std::optional<double>& step_time,
                                 const logging::RunRecord& run) {
  const SimConfig& sim = scenario.sim();
  Vector2d along(push.direction_x(), push.direction_y());
  if (!(along.norm() > 1e-12)) return {};
  const double sign = push.has_scaled_impulse() ? push.scaled_impulse() : push.peak();
  along *= (sign < 0 ? -1 : 1) / along.norm();
  const auto tick = static_cast<int64_t>(std::floor(push.start() / run.spec.tick_period())) +
                    run.spec.lead_ticks();
  if (sim.push_size() > 1 && tick >= run.num_ticks) return {};
  const ground_truth_t* truth = run.truth.at(std::min(tick, run.num_ticks - 1));
  if (truth == nullptr) return {};
  PushBound bound;
  const robot::RobotModel simulated = WithModelErrors(run.robot, sim);
  bound.mass = simulated.total_mass();
  // The start's posture is solved again only where the impulse is a share of what it gives.
  const double scale =
      push.has_scaled_impulse() ? ImpulseScale(simulated, SolveStart(simulated, sim.start())) : 0;
  bound.impulse = HorizontalImpulse(push, scale);
  std::vector<Vector2d> corners;
  double ground = 0;
  for (size_t f = 0; f < run.robot.feet().size(); ++f) {
    if (truth->foot_contact_points[f] == 0) continue;
    const Eigen::Isometry3d sole = GetPose(truth->foot_pose[f]);
    for (const Vector2d& at : robot::SoleCorners(run.robot.feet()[f])) {
      const Eigen::Vector3d corner = sole * Eigen::Vector3d(at.x(), at.y(), 0);
      corners.emplace_back(corner.x(), corner.y());
      ground += corner.z();
    }
  }
  if (corners.empty()) return bound;
  const Eigen::Vector3d com = GetVector3(truth->com_position);
  const double height = com.z() - ground / static_cast<double>(corners.size());
  if (!(height > 0)) return bound;
  const double frequency = std::sqrt(robot::kGravity / height);
  const Vector2d capture_point =
      com.head<2>() + GetVector3(truth->com_velocity).head<2>() / frequency;
  const double distance = DistanceToEdge(corners, capture_point, along).value_or(0);
  if (!(distance > 0)) return bound;
  bound.height = height;
  bound.distance = distance;
  bound.lip_impulse = bound.mass * frequency * bound.distance;
  bound.lip_impulse_of_duration =
      bound.lip_impulse / PendulumShare(push.profile(), push.duration(), frequency);
  if (step_time) {
    const stepping::StepChoice choice = MakeStepChoice(run.robot);
    for (const robot::Foot foot : robot::kFeet) {
      if (truth->foot_contact_points[robot::Index(foot)] == 0) continue;
      const Eigen::Isometry3d sole = GetPose(truth->foot_pose[robot::Index(foot)]);
      const Eigen::Vector3d ahead = sole.linear().col(0);
      const std::optional<double> farthest =
          FarthestSupport(choice, foot, sole.translation().head<2>(),
                          std::atan2(ahead.y(), ahead.x()), capture_point, along);
      if (farthest) bound.reach = std::max(bound.reach, *farthest - bound.distance);
    }
    bound.step_time = *step_time;
    bound.step_impulse = stepping::LargestImpulse(bound.mass, frequency, bound.distance,
                                                  bound.reach, bound.step_time, 1);
  }
  return bound;
}

}  // namespace

std::optional<PushBound> FindPushBound(const Scenario& scenario, const logging::RunRecord& run) {
  const SimConfig& sim = scenario.sim();
  if (sim.hand_size() > 0) return {};
  const std::optional<double> step_time = StepTime(scenario, run);
  std::optional<PushBound> nearest;
  for (const Push& push : sim.push()) {
    const std::optional<PushBound> bound = BoundOf(push, scenario, step_time, run);
    if (!bound) continue;
    const auto rank = [](const PushBound& of) {
      const double share = of.bounded() ? of.impulse / of.lip_impulse_of_duration : of.impulse;
      return std::pair(of.bounded(), share);
    };
    if (!nearest || rank(*bound) > rank(*nearest)) nearest = bound;
  }
  return nearest;
}

}  // namespace poise
