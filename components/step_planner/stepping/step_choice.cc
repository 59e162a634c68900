#include "components/step_planner/stepping/step_choice.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace poise::stepping {
namespace {

using Eigen::Vector2d;

// Greatest acceleration of a minimum-jerk line of unit length and time.
constexpr double kQuinticAcceleration = 5.7735026918962577;
// The step's time and the foothold, each of which follows from the other, after so many rounds.
constexpr int kRounds = 4;
constexpr double kTimeTolerance = 2e-3;  // s: a tick
// m of margin for which a step may take a second longer.
constexpr double kMarginOfTime = 0.05;
// m by which a step that does not catch the capture point must still come nearer than standing.
constexpr double kLeastGain = 0.02;

}  // namespace

double SwingTime(double distance, double acceleration) {
  return std::sqrt(kQuinticAcceleration * distance / acceleration);
}

Vector2d StepChoice::BrakingPoint(const StepState& state, int stance) const {
  const auto i = static_cast<size_t>(stance);
  return balance::NearestPoint(SoleAt(feet_[i], limits_.edge, state.sole[i], state.sole_yaw[i]),
                               state.pendulum.capture_point());
}

StepPlan StepChoice::At(const StepState& state, int foot, double time) const {
  const int stance = 1 - foot;
  const auto s = static_cast<size_t>(stance);
  const double w = state.pendulum.frequency;
  StepPlan plan;
  plan.foot = foot;
  plan.time = time;
  plan.yaw = state.yaw;
  plan.cop = BrakingPoint(state, stance);
  plan.capture_point = CapturePointAfter(state.pendulum.capture_point(), plan.cop, w, time);
  plan.com = After(state.pendulum, plan.cop, time).com;

  // From here on in axes of the heading, from the stance sole.
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(state.yaw).toRotationMatrix();
  const auto local = [&](const Vector2d& point) -> Vector2d {
    return turn.transpose() * (point - state.sole[s]);
  };
  const Vector2d caught = local(plan.capture_point), cop = local(plan.cop);
  const Vector2d away = caught - cop;
  const double distance = away.norm();
  Vector2d wanted = caught;
  if (distance > 0) wanted += limits_.beyond / distance * away;
  const double side = foot == robot::kLeftFoot ? 1 : -1;
  // Side by side as when standing, and nearer where the capture point is on the stance foot's side.
  const double narrow = std::max(side * caught.y() + 0.5 * limits_.spacing, reach_.least_spacing());
  wanted.y() = side * std::max(side * wanted.y(), std::min(limits_.spacing, narrow));
  const balance::ConvexPolygon footholds = reach_.Footholds(foot, local(plan.com));
  Vector2d foothold = wanted;
  if (footholds.num_corners > 0) {
    foothold = balance::NearestPoint(footholds, wanted);
  } else {
    foothold = {0, side * limits_.spacing};
  }
  plan.foothold = state.sole[s] + turn * foothold;
  const balance::ConvexPolygon soles =
      HullOf(SoleAt(feet_[s], limits_.edge, state.sole[s], state.sole_yaw[s]),
             SoleAt(feet_[static_cast<size_t>(foot)], limits_.edge, plan.foothold, plan.yaw));
  plan.margin = balance::SignedDistance(soles, plan.capture_point);
  // A COM that the stance leg cannot follow is as bad as a capture point outside.
  const double follows = balance::SignedDistance(reach_.Leg(stance, 1), Vector2d(-local(plan.com)));
  plan.margin = std::min(plan.margin, plan.margin + follows);
  return plan;
}

StepPlan StepChoice::Plan(const StepState& state, int foot) const {
  const double unload = state.in_contact[static_cast<size_t>(foot)] ? limits_.unload : 0;
  double time = unload + limits_.least_swing;
  StepPlan plan;
  for (int i = 0; i < kRounds; ++i) {
    plan = At(state, foot, time);
    const double distance = (plan.foothold - state.sole[static_cast<size_t>(foot)]).norm();
    const double needed =
        unload + std::max(limits_.least_swing, SwingTime(distance, limits_.acceleration));
    if (needed <= time + kTimeTolerance) break;
    time = needed;
  }
  return plan;
}

bool StepChoice::Helps(const StepState& state, const StepPlan& plan) const {
  if (plan.margin >= 0) return true;
  balance::ConvexPolygon soles;
  for (size_t i = 0; i < 2; ++i) {
    if (!state.in_contact[i]) continue;
    soles = HullOf(soles, SoleAt(feet_[i], limits_.edge, state.sole[i], state.sole_yaw[i]));
  }
  const Vector2d now = state.pendulum.capture_point();
  const Vector2d stays = CapturePointAfter(now, balance::NearestPoint(soles, now),
                                           state.pendulum.frequency, plan.time);
  return plan.margin > balance::SignedDistance(soles, stays) + kLeastGain;
}

StepPlan StepChoice::Choose(const StepState& state) const {
  StepPlan best;
  double best_score = 0;
  for (int foot = 0; foot < 2; ++foot) {
    // The stance foot must be there to stand on.
    if (!state.in_contact[static_cast<size_t>(1 - foot)]) continue;
    const StepPlan plan = Plan(state, foot);
    if (!std::isfinite(plan.margin) || !Helps(state, plan)) continue;
    const double score = std::min(plan.margin, limits_.enough) - kMarginOfTime * plan.time;
    if (best.foot < 0 || score > best_score) {
      best = plan;
      best_score = score;
    }
  }
  return best;
}

}  // namespace poise::stepping
