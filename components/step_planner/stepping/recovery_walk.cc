// The part of Recovery that walks.
#include <cmath>

#include "components/step_planner/stepping/recovery.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;

// m by which a walk's foothold may miss its place before a recovery's step is looked for.
constexpr double kMostMissed = 0.05;
// ωT of a step that another planner asks for, at most: what the capture point is off by has grown
// 20 times then.
constexpr double kMostOmegaStepTime = 3;
// Share of the standing height by which a push must have moved a walk's foothold for the step to
// tell nothing of undisturbed ones.
constexpr double kMoved = 0.08;

}  // namespace

Gait Recovery::gait(const StepState& state) const {
  const double transfer = std::min(transfer_, kWalkLoadTime);
  if (command_.has_footholds()) {
    const StepLimits& limits = choice_.limits();
    const double least = limits.unload + limits.least_swing + transfer;
    const double most = std::max(least, kMostOmegaStepTime / state.pendulum.frequency);
    return {command_, std::clamp(command_.period, least, most), transfer, kGain};
  }
  return {stride_.Corrected(command_), kOmegaStepTime / state.pendulum.frequency, transfer, kGain};
}

StepPlan Recovery::WalkOn(const StepState& state, Foot foot, double unload,
                          StepReason* reason) const {
  return OrCaught(state, choice_.Stride(state, foot, gait(state), unload), unload, reason);
}

StepPlan Recovery::OrCaught(const StepState& state, const StepPlan& stride, double unload,
                            StepReason* reason) const {
  *reason = StepReason::kWalk;
  if (std::isfinite(stride.margin) && stride.missed < kMostMissed) return stride;
  const StepPlan caught = choice_.Next(state, stride.foot, unload);
  if (!caught.possible || !(caught.margin > stride.margin)) return stride;
  *reason = StepReason::kAgain;
  return caught;
}

void Recovery::SetOff(const StepInput& input, const StepState& state) {
  plan_ = StepPlan();
  plan_.foot = FirstFoot(command_);
  reason_ = StepReason::kWalk;
  BeginShift(input, state);
  BeginTurning(state);
}

void Recovery::BeginTurning(const StepState& state) {
  if (turns_) return;
  turns_ = true;
  stride_.Forget();
  heading_.Begin(state.yaw);
}

void Recovery::TurnBody(const StepState& state, double period) {
  if (!turns_) return;
  const bool steps = stage_ == Stage::kUnloading || stage_ == Stage::kSwinging;
  heading_.Follow(state.sole_yaw[Other(plan_.foot)], steps ? plan_.yaw : state.sole_yaw[plan_.foot],
                  period);
}

void Recovery::ShiftToStride(const StepInput& input, const StepState& state, double excess) {
  if (excess > kLeastExcess) {
    BeginStep(input, choice_.Choose(state), StepReason::kOutside);
  } else if (!command_.stepping) {
    stage_ = Stage::kCatching;
    since_ = moving_since_ = input.time;
    cop_from_ = output_.cop;
  } else if (input.time >= since_ + kSetOffTime - kTimeTolerance) {
    StepReason reason = StepReason::kWalk;
    const StepPlan plan = WalkOn(state, plan_.foot, choice_.limits().unload, &reason);
    BeginStep(input, plan, reason);
  }
}

void Recovery::CountStride(const StepInput& input) {
  if (!command_.stepping || command_.has_footholds() || reason_ != StepReason::kWalk ||
      plan_.moved > kMoved * standing_height_) {
    stride_.Forget();
    return;
  }
  const StepState state = Observe(input, in_contact_);
  stride_.Land(input.time, 0.5 * (state.sole[0] + state.sole[1]), state.yaw, command_);
}

}  // namespace poise::stepping
