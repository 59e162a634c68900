#include "components/step_planner/stepping/recovery.h"

#include <algorithm>
#include <cmath>

#include "components/balance/minimum_jerk.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// m beyond the soles from which on neither ankles nor hips are trusted to bring the capture point
// back. Fitted to G1's pushes; as many steps as with 15 mm are needless (docs/lab/steps).
constexpr double kHopelessExcess = 0.005;
constexpr double kAgainAfter = 0.03;   // s beyond the soles of a step: longer than its touch
constexpr double kNearEdgeTime = 0.1;  // s near the soles' edge: a push that stands is out sooner
constexpr int kMostSteps = 12;         // in a row: an end to steps that catch nothing
// Share of the ample margin, below which the other foot goes on as one lands: both feet on the
// ground cost the time in which the capture point leaves them.
constexpr double kStepOnShare = 0.5;
// Shares of the angular momentum about the COM that count in the capture point, in a walk and in
// other steps. What the swinging leg and the turning body lend to the COM then moves no foothold.
constexpr double kWalkMomentumShare = 1, kMomentumShare = 0.5;
constexpr double kTransferGain = 0.2;  // of a landing, in the time until a landed foot carries
// 1/s, critically damped: a turned body returns to upright at this rate, and the COM's reference
// leaves room within the soles for what that takes.
constexpr double kLeanRate = 6;
constexpr double kCatchBudget = 0.1;  // m of centre of pressure that it takes at most on both feet
// The robot is at rest once the capture point has been within kStillDistance, m, of the soles'
// middle, and the COM slower than kStillSpeed, m/s, for kStillTime, s. A swing of the COM lasts
// longer.
constexpr double kStillDistance = 0.03, kStillSpeed = 0.06, kStillTime = 0.3;
// s after which a COM that stands still beside the middle is at rest, too: friction of the joints
// holds it there.
constexpr double kStillBesideTime = 1;
// Feet are put side by side without haste, as no fall is to be caught.
constexpr double kTogetherShift = 1.5;  // s in which the COM goes above the foot that stays
constexpr double kMostShifts = 2.5;     // times that, after which it is given up
constexpr double kTogetherRamp = 0.2, kTogetherSwing = 0.7;  // s, of the load and in the air
constexpr double kTogetherGain = 1;  // friction of the joints leaves less of an error with it
constexpr double kTogetherDistance = 0.03;  // m from side by side that is side by side

}  // namespace

double Recovery::Excess(const StepState& state) const {
  return -balance::SignedDistance(choice_.Soles(state, 0), state.pendulum.capture_point());
}

void Recovery::Watch(double time, double excess) {
  stays_outside_ = outside_.Update(time, excess > 0, kAgainAfter);
  const bool was_near = near_edge_.holds();
  const bool near = !active() && excess > -spec_.margin_to_sole_edge;
  stays_near_edge_ = near_edge_.Update(time, near, kNearEdgeTime);
  if (near && !was_near) excess_at_edge_ = excess;
}

bool Recovery::Update(const StepInput& input) {
  const double time = input.time;
  const bool walks = active() && reason_ == StepReason::kWalk;
  StepState state = Observe(input, active() ? in_contact_ : input.in_contact,
                            walks ? kWalkMomentumShare : kMomentumShare);
  const double excess = Excess(state);
  Watch(time, excess);
  const double period = TickPeriod(time - time_);
  command_ = Approach(command_, input.command, period * kAcceleration, period * kTurnAcceleration);
  switch (stage_) {
    case Stage::kStanding:
      Stand(input, state, excess);
      break;
    case Stage::kShifting:
      Shift(input, state, excess);
      break;
    case Stage::kUnloading:
      if (time >= steps_.first().lift_off - kTimeTolerance) LiftOff(input);
      break;
    case Stage::kSwinging:
      if (foot_.Update(input, plan_.foot, choice_.foot(plan_.foot))) Land(input);
      break;
    case Stage::kTouching:  // the first load counts
      break;
    case Stage::kLoading:
      if (StepAtLanding(input, state)) break;
      if (time >= steps_.landed().load - kTimeTolerance) {
        stage_ = Stage::kCatching;
        since_ = moving_since_ = time;
      }
      break;
    case Stage::kCatching:
      Catch(input, state);
      break;
  }
  if (stage_ == Stage::kStanding) {
    time_ = time;
    return false;
  }
  state.in_contact = in_contact_;
  Replan(input, state);
  LeadCom(input, state);
  output_.Follow(foot_);
  output_.in_contact = in_contact_;
  output_.foot = plan_.foot;
  output_.transition = TransitionOf(stage_);
  output_.progress =
      output_.transition == TransitionKind::kNone ? 0 : std::clamp(Ramp(time), 0.0, 1.0);
  time_ = time;
  return true;
}

void Recovery::Stand(const StepInput& input, const StepState& state, double excess) {
  turns_ = false;
  const StepReason need = NeedOfFirstStep(input, state, excess);
  if (need == StepReason::kNone && command_.stepping && input.allowed && input.in_contact[0] &&
      input.in_contact[1]) {
    SetOff(input, state);
    return;
  }
  if (StepPlan plan; need == StepReason::kNone && TogetherNow(input, state, &plan)) {
    together_asked_ = false;
    plan_ = plan;
    reason_ = StepReason::kTogether;
    BeginShift(input, state);
  }
  step_helps_ = true;
  if (spec_.watched_margin >= 0 && stage_ == Stage::kStanding && excess > -spec_.watched_margin) {
    const StepPlan plan = choice_.Choose(state);
    step_helps_ = plan.possible && choice_.Helps(state, plan);
  }
  if (need == StepReason::kNone) return;
  const Foot stance = state.in_contact[Foot::kRight] ? Foot::kRight : Foot::kLeft;
  standing_height_ = input.com_height - input.sole[stance].translation().z();
  height_.Begin(input.com_height);
  steps_now_ = 0;
  in_contact_ = input.in_contact;
  output_.cop = balance::NearestPoint(choice_.Soles(state), state.pendulum.capture_point());
  BeginStep(input, choice_.Choose(state), need);
}

void Recovery::Catch(const StepInput& input, const StepState& state) {
  if (command_.stepping) {
    steps_now_ = 0;
    BeginTurning(state);
    const Vector2d way = state.pendulum.capture_point() - MiddleOfSoles(state);
    // The foot that the capture point is nearer to stays.
    const double left = std::cos(state.yaw) * way.y() - std::sin(state.yaw) * way.x();
    StepReason reason = StepReason::kWalk;
    StepPlan plan =
        WalkOn(state, left > 0 ? Foot::kRight : Foot::kLeft, choice_.limits().unload, &reason);
    // Beyond that foot's far edge only it can catch the capture point, once the other one stands.
    if (reason == StepReason::kAgain) plan = choice_.Choose(state);
    BeginStep(input, plan, reason);
  } else if (stays_outside_ && steps_now_ < kMostSteps) {
    BeginStep(input, choice_.Choose(state), StepReason::kAgain);
  } else if (AtRest(input, state)) {
    stage_ = Stage::kStanding;
    const bool caught = reason_ != StepReason::kTogether;
    // A walk ends with the feet side by side.
    if (caught && turns_) together_asked_ = true;
  }
}

StepReason Recovery::NeedOfFirstStep(const StepInput& input, const StepState& state,
                                     double excess) {
  if (!input.allowed) return StepReason::kNone;
  if (spec_.margin_to_sole_edge > 0 && stays_near_edge_ && excess > excess_at_edge_) {
    const StepPlan plan = choice_.Choose(state);
    if (plan.possible && plan.margin >= 0) return StepReason::kLingering;
  }
  if (!(excess > 0)) return StepReason::kNone;
  if (input.step_needed) return StepReason::kPersistent;
  return excess > kHopelessExcess ? StepReason::kOutside : StepReason::kNone;
}

StepStatus Recovery::status() const {
  const bool under_way = !steps_.empty();
  Footstep step = under_way ? steps_.first() : steps_.landed();
  if (stage_ == Stage::kShifting) {
    step.foot = plan_.foot;
    step.at = {plan_.foothold, plan_.yaw};
  }
  return {stage_, reason_, under_way, step, plan_.margin};
}

double Recovery::UnloadTime() const {
  return reason_ == StepReason::kTogether ? kTogetherRamp : choice_.limits().unload;
}

double Recovery::LoadTime() const {
  if (reason_ == StepReason::kTogether) return kTogetherRamp;
  return reason_ == StepReason::kWalk ? kWalkLoadTime : kLoadTime;
}

bool Recovery::TogetherNow(const StepInput& input, const StepState& state, StepPlan* plan) {
  if (!together_asked_) {
    moving_since_ = input.time;
    return false;
  }
  if (!input.allowed || !input.in_contact[0] || !input.in_contact[1] || !AtRest(input, state)) {
    return false;
  }
  for (const Foot foot : kFeet) {
    const StepPlan beside = choice_.Beside(state, foot, kTogetherRamp + kTogetherSwing);
    const double way = (beside.foothold - state.sole[foot]).norm();
    if (way < kTogetherDistance) {
      together_asked_ = false;
      return false;
    }
    // A foot that goes straight rather than one that goes around the other leg.
    if (std::isfinite(beside.margin) && (!plan->possible || !beside.around)) *plan = beside;
  }
  return plan->possible;
}

void Recovery::BeginShift(const StepInput& input, const StepState& state) {
  if (num_begun_ == 0) standing_height_ = input.com_height - input.sole[0].translation().z();
  height_.Begin(input.com_height);
  steps_now_ = 0;
  in_contact_ = input.in_contact;
  const bool walks = reason_ == StepReason::kWalk;
  shift_ = {state.pendulum.capture_point(), input.time, walks ? kSetOffTime : kTogetherShift};
  cop_from_ = output_.cop = shift_.from;
  since_ = input.time;
  stage_ = Stage::kShifting;
}

void Recovery::Shift(const StepInput& input, const StepState& state, double excess) {
  if (reason_ == StepReason::kWalk) {
    ShiftToStride(input, state, excess);
    return;
  }
  const balance::ConvexPolygon sole = choice_.Sole(state, Other(plan_.foot));
  const double over = input.time - since_;
  const bool above = over >= kTogetherShift - kTimeTolerance &&
                     balance::Contains(sole, state.pendulum.com) &&
                     balance::Contains(sole, state.pendulum.capture_point());
  if (excess > 0 || (!above && over > kMostShifts * kTogetherShift)) {
    // Pushed meanwhile, or it does not get there.
    stage_ = Stage::kCatching;
    since_ = moving_since_ = input.time;
    cop_from_ = output_.cop;
  } else if (above) {
    BeginStep(input, choice_.Beside(state, plan_.foot, kTogetherRamp + kTogetherSwing),
              StepReason::kTogether);
  }
}

bool Recovery::BeginStep(const StepInput& input, const StepPlan& plan, StepReason reason) {
  if (!plan.possible || !std::isfinite(plan.margin)) return false;
  reason_ = reason;
  ++num_begun_;
  ++steps_now_;
  since_ = input.time;
  cop_from_ = output_.cop;
  ramp_from_ = 0;
  stage_ = Stage::kUnloading;
  Footstep step;
  step.foot = plan.foot;
  step.unload = input.time;
  step.lift_off = input.time + UnloadTime();
  step.touch_down = input.time + plan.time;
  step.load = step.touch_down + LoadTime();
  steps_.Clear();
  steps_.Add(step);
  SetPlan(plan);
  if (!in_contact_[plan.foot]) LiftOff(input, input.free_foot, input.free_rotation);
  return true;
}

void Recovery::SetPlan(const StepPlan& plan) {
  plan_ = plan;
  Footstep& step = steps_.first();
  step.at = {plan.foothold, plan.yaw};
  step.around = plan.around;
  step.corner = plan.corner;
}

void Recovery::LiftOff(const StepInput& input) {
  const Eigen::Isometry3d& sole = input.sole[plan_.foot];
  LiftOff(input, {.position = sole.translation()}, sole.linear());
}

void Recovery::LiftOff(const StepInput& input, const PointMotion& from,
                       const Eigen::Matrix3d& rotation) {
  in_contact_[plan_.foot] = false;
  steps_.first().lift_off = input.time;
  const double ground = input.sole[Other(plan_.foot)].translation().z();
  foot_.LiftOff(from, rotation, steps_.first(), ground, ground, kSwing, input.time);
  stage_ = Stage::kSwinging;
  since_ = input.time;
  cop_from_ = output_.cop;
}

void Recovery::Land(const StepInput& input) {
  in_contact_[plan_.foot] = true;
  CountStride(input);
  steps_.Land(input.time, input.time + LoadTime());
  stage_ = Stage::kLoading;
  since_ = input.time;
  cop_from_ = output_.cop;
}

bool Recovery::StepAtLanding(const StepInput& input, const StepState& state) {
  if (command_.stepping) steps_now_ = 0;
  if (reason_ == StepReason::kTogether || steps_now_ >= kMostSteps) return false;
  const Foot other = Other(plan_.foot);
  // A foot that has only tapped the ground carries nothing: the robot would fall from the other
  // one.
  if (!(input.load[plan_.foot] > input.load[other])) return false;
  StepReason reason = command_.stepping ? StepReason::kWalk : StepReason::kAgain;
  StepPlan next;
  if (command_.stepping) {
    next = WalkOn(state, other, 0, &reason);
  } else {
    const double margin =
        balance::SignedDistance(choice_.Soles(state), state.pendulum.capture_point());
    if (margin > kStepOnShare * choice_.limits().ample_margin) return false;
    next = choice_.Next(state, other, 0);
  }
  if (reason_ == StepReason::kWalk) {
    transfer_ += kTransferGain * (input.time - since_ - transfer_);
  }
  if (!BeginStep(input, next, reason)) return false;
  LiftOff(input);
  return true;
}

void Recovery::Replan(const StepInput& input, const StepState& state) {
  if (stage_ != Stage::kUnloading && stage_ != Stage::kSwinging) return;
  const bool swings = stage_ == Stage::kSwinging, walks = reason_ == StepReason::kWalk;
  // A push takes over a foot that is under way to the other's side.
  if (reason_ == StepReason::kTogether) {
    if (!(Excess(state) > kLeastExcess)) return;
    Hurry(input.time);
  }
  Footstep& step = steps_.first();
  if (!swings && !walks) {
    const double unload = step.lift_off - input.time;
    StepPlan next = choice_.Next(state, plan_.foot, unload);
    // Out of reach, the foot still has to be down soon.
    if (!next.possible) next = choice_.Plan(state, plan_.foot, unload, plan_.crossing);
    step.touch_down = input.time + next.time;
    step.load = step.touch_down + LoadTime();
    if (std::isfinite(next.margin)) SetPlan(next);
    return;
  }
  const double left = step.touch_down - input.time;
  if (!(left > kSwing.freeze)) return;
  StepPlan next = walks ? choice_.StrideAt(state, plan_.foot, gait(state), left)
                        : choice_.At(state, plan_.foot, left, plan_.crossing);
  if (walks && swings) {
    next = OrCaught(state, next, 0, &reason_);
    if (reason_ == StepReason::kAgain) {
      step.touch_down = input.time + next.time;
      step.load = step.touch_down + LoadTime();
      SetPlan(next);
      LiftOff(input, foot_.reference(), foot_.rotation().rotation);
      return;
    }
  }
  // A foothold that the way under way does not lead to is none.
  const bool leads = walks || foot_.swing().around() || !next.around;
  if (std::isfinite(next.margin) && leads) SetPlan(next);
  if (swings) foot_.Move(step, input.time);
}

void Recovery::Hurry(double time) {
  reason_ = StepReason::kAgain;
  if (stage_ != Stage::kUnloading) return;
  const double share = std::clamp(Ramp(time), 0.0, 1.0);
  Footstep& step = steps_.first();
  step.unload = time - share * UnloadTime();
  step.lift_off = step.unload + UnloadTime();
  ramp_from_ = share;
  cop_from_ = output_.cop;
}

double Recovery::Ramp(double time) const {
  if (stage_ == Stage::kUnloading) {
    const Footstep& step = steps_.first();
    return (time - step.unload) / (step.lift_off - step.unload);
  }
  const Footstep& step = steps_.landed();
  return (time - step.touch_down) / (step.load - step.touch_down);
}

Vector2d Recovery::MiddleOfSoles(const StepState& state) const {
  return 0.5 * (state.sole[0] + state.sole[1]);
}

Vector2d Recovery::ForBody(const StepInput& input, double budget) const {
  // L̇ = −J (λ² lean + 2 λ turning) about the COM takes a centre of pressure (−L̇_y, L̇_x)/(m g) off.
  const Vector3d moment =
      spec_.turn_share * kLeanRate * (kLeanRate * input.lean + 2 * input.turning);
  const Vector2d offset(moment.y(), -moment.x());
  const double length = offset.norm();
  return length > budget ? Vector2d(budget / length * offset) : offset;
}

Vector2d Recovery::CopFor(const StepInput& input, const StepState& state,
                          const balance::ConvexPolygon& support, const CaptureReference& reference,
                          double budget) const {
  const bool gently = stage_ == Stage::kShifting || reason_ == StepReason::kTogether;
  const double gain = gently ? std::max(kGain, kTogetherGain) : kGain;
  return LeadingCop(state.pendulum, reference, gain, support, ForBody(input, budget));
}

Vector2d Recovery::BrakingCop(const StepInput& input, const StepState& state) const {
  const Foot stance = Other(plan_.foot);
  const balance::ConvexPolygon sole = choice_.Sole(state, stance);
  if (reason_ == StepReason::kTogether) {
    return CopFor(input, state, sole, {state.sole[stance], Vector2d::Zero()}, kSwingBudget);
  }
  if (reason_ == StepReason::kWalk) {
    const Gait walk = gait(state);
    const double left = steps_.first().touch_down + walk.transfer - input.time;
    return CopFor(input, state, sole, choice_.StrideReference(state, stance, walk, left),
                  kSwingBudget);
  }
  // It only brakes: what is left of the way is the foot's.
  return LeadingCop(state.pendulum, {state.pendulum.capture_point(), Vector2d::Zero()}, 0, sole,
                    ForBody(input, kSwingBudget));
}

Vector2d Recovery::CatchingCop(const StepInput& input, const StepState& state) const {
  const balance::ConvexPolygon soles = choice_.Soles(state);
  const bool walks = command_.stepping && reason_ == StepReason::kWalk;
  if (stage_ == Stage::kShifting) {
    const Foot stance = Other(plan_.foot);
    const Vector2d to =
        walks ? choice_.CapturePointAtLiftOff(state, stance, gait(state)) : state.sole[stance];
    return CopFor(input, state, soles, shift_.At(input.time, to), kCatchBudget);
  }
  if (walks) {
    const Gait walk = gait(state);
    return CopFor(input, state, soles,
                  choice_.StrideReference(state, plan_.foot, walk, walk.period), kSwingBudget);
  }
  return CopFor(input, state, soles, {MiddleOfSoles(state), Vector2d::Zero()}, kCatchBudget);
}

bool Recovery::AtRest(const StepInput& input, const StepState& state) {
  const bool slow = input.com_velocity.norm() < kStillSpeed;
  const bool near = (state.pendulum.capture_point() - MiddleOfSoles(state)).norm() < kStillDistance;
  if (!slow || !(near || Excess(state) < -kStillDistance)) moving_since_ = input.time;
  return input.time >= moving_since_ + (near ? kStillTime : kStillBesideTime) - kTimeTolerance;
}

double Recovery::LoweringShare(const StepState& state) const {
  const double held = std::min(spec_.holding_lowering / choice_.reach().lowering(), 1.0);
  // A walk keeps its height: a COM that comes down with each step brings its foot down too soon.
  if (command_.stepping && reason_ == StepReason::kWalk) return held;
  const bool together = reason_ == StepReason::kTogether;
  const bool steps = stage_ == Stage::kUnloading || stage_ == Stage::kSwinging;
  // A knee that gets straight is stopped, and its foot hangs short of the foothold.
  if (!together && (steps || stage_ == Stage::kLoading)) return 1;
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(-state.yaw).toRotationMatrix();
  FootArray<Vector2d> offset;
  // Where both soles and the COM will be.
  const Vector2d com = steps ? plan_.com : state.pendulum.com;
  for (const Foot foot : kFeet) {
    const bool swings = steps && foot == plan_.foot;
    offset[foot] = turn * ((swings ? plan_.foothold : state.sole[foot]) - com);
  }
  const double walking = command_.stepping ? held : 0;
  // With the feet put together nothing is to be caught, and knees that are bent for seconds get
  // hot.
  if (together) return std::min(std::max(walking, choice_.reach().UsefulLowering(offset)), held);
  return std::min(std::max(walking, choice_.reach().LoweringShare(offset)), 1.0);
}

void Recovery::LeadCom(const StepInput& input, const StepState& state) {
  const double period = TickPeriod(input.time - time_);
  // The height, critically damped.
  const Foot stance =
      stage_ == Stage::kShifting || stage_ == Stage::kUnloading || stage_ == Stage::kSwinging
          ? Other(plan_.foot)
          : plan_.foot;
  const double ground = input.sole[stance].translation().z();
  const double wanted =
      ground + standing_height_ - LoweringShare(state) * choice_.reach().lowering();
  const bool catches = reason_ != StepReason::kWalk && reason_ != StepReason::kTogether;
  height_.set_rate(catches ? kCatchingHeightRate : kHeightRate);
  height_.Follow(wanted, period);
  TurnBody(state, period);

  double share = 1;
  Vector2d cop = output_.cop;
  switch (stage_) {
    case Stage::kUnloading:
    case Stage::kSwinging:
      cop = BrakingCop(input, state);
      if (stage_ == Stage::kUnloading) {
        share = (Ramp(input.time) - ramp_from_) / (1 - ramp_from_);
      }
      break;
    case Stage::kShifting:
    case Stage::kLoading:
    case Stage::kCatching:
      cop = CatchingCop(input, state);
      if (stage_ == Stage::kLoading) share = Ramp(input.time);
      break;
    case Stage::kStanding:
    case Stage::kTouching:
      break;
  }
  share = balance::SmoothStep(share);
  cop = cop_from_ + share * (cop - cop_from_);
  output_.cop = cop;
  output_.cop_reference << cop, ground;
  output_.com = LeadByCop(input, height_.point(), output_.cop_reference);
}

void Recovery::Archive(StateArchive* archive) {
  archive->Show(stage_, reason_, num_begun_, steps_now_, in_contact_, plan_, steps_, foot_, height_,
                outside_, near_edge_, time_, since_, ramp_from_, stays_outside_, stays_near_edge_,
                excess_at_edge_, moving_since_, cop_from_, standing_height_, together_asked_,
                shift_, step_helps_, command_, turns_, heading_, stride_, transfer_, output_);
}

}  // namespace poise::stepping
