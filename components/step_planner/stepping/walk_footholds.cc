// The part of Walk that looks ahead: the steps that it counts with, and where they come down.
#include <algorithm>
#include <cmath>
#include <limits>

#include "components/step_planner/stepping/walk.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;

// Footsteps that the plan looks ahead: what comes later counts by e^{−3 ω T} at most.
constexpr int kAhead = Walk::kPlannedSteps;

}  // namespace

int Walk::Planned(std::array<PlannedStep, kPlannedSteps>* steps) const {
  if (!active() || final_) return 0;
  double due = touch_down_;  // of a foot that swings
  switch (stage_) {
    case WalkStage::kStarting:
      due = since_ + spec_.start + spec_.unload + spec_.swing;
      break;
    case WalkStage::kUnloading:
      due = since_ + spec_.unload + spec_.swing;
      break;
    case WalkStage::kLoading:
      due = since_ + spec_.load + spec_.unload + spec_.swing;
      break;
    default:
      break;
  }
  Footstep next = foothold_;
  Foot foot = stepping_foot();
  int count = 0;
  for (PlannedStep& step : *steps) {
    step = {next, foot, due + count * spec_.period()};
    ++count;
    if (closing_) break;
    foot = Other(foot);
    next = Next(next, foot);
  }
  return count;
}

double Walk::HighestForStep(const StepInput& input, const StepState& state) const {
  const bool steps = stage_ == WalkStage::kUnloading || OnOneFoot();
  if (!steps) return std::numeric_limits<double>::infinity();
  const Foot s = stance_;
  FootArray<Vector2d> offset{Vector2d::Zero(), Vector2d::Zero()};
  offset[Other(s)] = Eigen::Rotation2Dd(-state.yaw) * (foothold_.position - state.sole[s]);
  const double share = std::min(choice_.reach().LoweringShare(offset), 1.0);
  return GroundAt(input, foothold_) + standing_height_ - share * choice_.reach().lowering();
}

bool Walk::AcrossEdge(const Footstep& foothold) const {
  if (spec_.ground.empty()) return false;
  const Foot foot = Other(stance_);
  const balance::ConvexPolygon sole =
      SoleAt(choice_.foot(foot), 0, foothold.position, foothold.yaw);
  double rear = foothold.position.x(), front = rear;
  for (const Vector2d& corner : sole.corners()) {
    rear = std::min(rear, corner.x());
    front = std::max(front, corner.x());
  }
  return spec_.ground.EdgeWithin(foot, rear, front);
}

void Walk::PlanFrom(const StepState& state) {
  const double between = spec_.load + spec_.unload, w = state.pendulum.frequency;
  Footstep stance = Standing(state, stance_);
  const bool both = !starting_ && !OnOneFoot();
  plan_.Clear();
  if (final_) {
    const Vector2d middle = 0.5 * (state.sole[0] + state.sole[1]);
    plan_.Append(from_cop_, middle, between);
    plan_.Finish(w, middle);
    return;
  }
  if (both) plan_.Append(from_cop_, stance.position, between);
  plan_.Append(stance.position, stance.position, spec_.single());
  Footstep next = foothold_;
  if (closing_) {
    const Vector2d middle = 0.5 * (stance.position + next.position);
    plan_.Append(stance.position, middle, between);
    plan_.Finish(w, middle);
    return;
  }
  Foot foot = stance_;
  for (int i = 0; i < kAhead; ++i) {
    plan_.Append(stance.position, next.position, between);
    plan_.Append(next.position, next.position, spec_.single());
    stance = next;
    next = Next(stance, foot);
    foot = Other(foot);
  }
  plan_.Finish(w, stance.position);
}

void Walk::Adjust(const StepInput& input, const StepState& state) {
  // Until the foot carries.
  const double left = touch_down_ + spec_.settle - input.time;
  if (swing_.frozen(input.time)) return;
  const Foot s = stance_;
  const double w = state.pendulum.frequency;
  const Vector2d& stance = state.sole[s];
  // The plan for the foothold that the command asks for.
  const Vector2d moved = foothold_.position;
  foothold_.position = NextOnCourse(Standing(state, stance_), Other(stance_)).position;
  PlanFrom(state);
  const Vector2d planned = plan_.At(spec_.single()).capture_point;
  const Vector2d now = state.pendulum.capture_point();
  const Vector2d error = now - plan_.At(spec_.single() - left).capture_point;
  const double size = error.norm();
  const balance::ConvexPolygon sole =
      SoleAt(choice_.foot(stance_), choice_.limits().sole_margin, stance, state.sole_yaw[s]);
  // What the centre of pressure at the sole's edge leaves of the error at touch-down.
  const Vector2d cop = balance::NearestPoint(sole, stance + (1 + spec_.gain) * error);
  const Vector2d caught = CapturePointAfter(now, cop, w, left);
  double missing = 0;  // m of the error that the foothold has to take
  if (size > 0) missing = (caught - planned).dot(error) / size - spec_.adjust_from;
  if (!(missing > 0)) {
    // Back to what is commanded, once the error is small enough.
    if (!moved.isApprox(foothold_.position, 1e-12)) {
      swing_.Move(foothold_.position, input.time, touch_down_);
    }
    return;
  }
  // A foothold farther by d takes the plan's capture point at touch-down d (1 − e^{−ωB})/(ωB)
  // farther, for the centre of pressure needs B to get there.
  const double between = w * (spec_.load + spec_.unload);
  missing *= between / (1 - std::exp(-between));
  Vector2d foothold = foothold_.position + missing / size * error;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(state.yaw).toRotationMatrix();
  const Vector2d com = After(state.pendulum, cop, left).com;
  const balance::ConvexPolygon footholds =
      choice_.reach().Footholds(Other(stance_), turn.transpose() * (com - stance));
  if (footholds.num_corners == 0) return;
  const Vector2d offset = turn.transpose() * (foothold - stance);
  foothold = stance + turn * balance::NearestPoint(footholds, offset);
  foothold_.position = foothold;
  PlanFrom(state);
  swing_.Move(foothold, input.time, touch_down_);
}

}  // namespace poise::stepping
