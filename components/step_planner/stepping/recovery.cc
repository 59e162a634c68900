#include "components/step_planner/stepping/recovery.h"

#include <algorithm>
#include <cmath>

#include "components/balance/contact_transition.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMaxPeriod = 0.02;  // s, counted at most for a tick after a gap
// Share of a swing before which a load is the ground that the foot leaves, or a tap on the way up.
constexpr double kLeastProgress = 0.5;
constexpr double kGently = 0.2;     // s of the load's ramps where no fall is to be caught
constexpr double kGentleGain = 1;   // as `gain`: the joints' friction leaves less of an error
constexpr double kStill = 1;        // s that the COM rests beside the middle until that is rest
constexpr double kTogether = 0.03;  // m from side by side that is side by side
// Time constant, as a share of the settling, with which a foot that touches is let go.
constexpr double kLetGo = 0.25;
constexpr double kMostShifts = 2.5;  // times its time after which a shift is given up

}  // namespace

balance::ConvexPolygon Recovery::Soles(const StepState& state, double edge) const {
  balance::ConvexPolygon soles;
  for (int i = 0; i < 2; ++i) {
    const auto foot = static_cast<size_t>(i);
    if (!state.in_contact[foot]) continue;
    soles = HullOf(soles, SoleAt(choice_.foot(i), edge, state.sole[foot], state.sole_yaw[foot]));
  }
  return soles;
}

double Recovery::Beyond(const StepState& state) const {
  return -balance::SignedDistance(Soles(state, 0), state.pendulum.capture_point());
}

bool Recovery::Update(const StepInput& input) {
  const double time = input.time;
  StepState state = Observe(input, active() ? in_contact_ : input.in_contact, spec_.momentum);
  const double beyond = Beyond(state);
  if (!(beyond > 0)) {
    beyond_since_ = -1;
  } else if (beyond_since_ < 0) {
    beyond_since_ = time;
  }
  if (active() || !(beyond > -spec_.lingering)) {
    lingers_since_ = -1;
  } else if (lingers_since_ < 0) {
    lingers_since_ = time;
    lingered_from_ = beyond;
  }
  switch (stage_) {
    case Stage::kIdle: {
      const StepReason need = NeedOfFirstStep(input, state, beyond);
      if (StepPlan plan; need == StepReason::kNone && TogetherNow(input, state, &plan)) {
        together_asked_ = false;
        together_at_ = -1;
        plan_ = plan;
        if (num_steps_ == 0) standing_height_ = input.com_height - input.sole[0].translation().z();
        height_.Begin(input.com_height);
        steps_now_ = 0;
        in_contact_ = input.in_contact;
        shift_from_ = state.pendulum.capture_point();
        cop_from_ = output_.cop = shift_from_;
        since_ = time;
        stage_ = Stage::kShifting;
      }
      step_helps_ = !(spec_.watch >= 0 && stage_ == Stage::kIdle && beyond > -spec_.watch &&
                      choice_.Choose(state).foot < 0);
      if (need == StepReason::kNone) break;
      const size_t stance = state.in_contact[0] ? 0 : 1;
      standing_height_ = input.com_height - input.sole[stance].translation().z();
      height_.Begin(input.com_height);
      steps_now_ = 0;
      in_contact_ = input.in_contact;
      output_.cop = balance::NearestPoint(Soles(state, choice_.limits().edge),
                                          state.pendulum.capture_point());
      BeginStep(input, choice_.Choose(state), need);
      break;
    }
    case Stage::kShifting:
      Shift(input, state, beyond);
      break;
    case Stage::kUnloading:
      if (time >= since_ + UnloadTime() - kTimeTolerance) LiftOff(input);
      break;
    case Stage::kSwinging:
      if (Touches(input)) Land(input);
      break;
    case Stage::kLoading:
      if (time >= since_ + LoadTime() - kTimeTolerance) {
        stage_ = Stage::kCatching;
        since_ = moving_since_ = time;
      }
      break;
    case Stage::kCatching:
      if (beyond_since_ >= 0 && time >= beyond_since_ + spec_.again_after - kTimeTolerance &&
          steps_now_ < spec_.max_steps) {
        BeginStep(input, choice_.Choose(state), StepReason::kAgain);
      } else if (const int foot = FootToBring(state); foot >= 0 && steps_now_ < spec_.max_steps) {
        BeginStep(input, choice_.Beside(state, foot, kGently + spec_.together_swing),
                  StepReason::kTogether);
      } else if (AtRest(input, state)) {
        stage_ = Stage::kIdle;
        const bool caught = reason_ != StepReason::kTogether;
        if (caught && spec_.together_after > 0) together_at_ = time + spec_.together_after;
      }
      break;
  }
  if (stage_ == Stage::kIdle) {
    time_ = time;
    return false;
  }
  state.in_contact = in_contact_;
  Swings(input, state);
  LeadCom(input, state);
  output_.in_contact = in_contact_;
  output_.foot = plan_.foot;
  output_.transition = stage_ == Stage::kUnloading ? -1 : stage_ == Stage::kLoading ? 1 : 0;
  const double ramp = stage_ == Stage::kUnloading ? UnloadTime() : LoadTime();
  output_.progress = output_.transition == 0 ? 0 : std::clamp((time - since_) / ramp, 0.0, 1.0);
  time_ = time;
  return true;
}

StepReason Recovery::NeedOfFirstStep(const StepInput& input, const StepState& state,
                                     double beyond) {
  if (!input.allowed || spec_.max_steps < 1) return StepReason::kNone;
  if (spec_.lingering > 0 && lingers_since_ >= 0 && beyond > lingered_from_ &&
      input.time >= lingers_since_ + spec_.lingering_time - kTimeTolerance) {
    const StepPlan plan = choice_.Choose(state);
    if (plan.foot >= 0 && plan.margin >= 0) return StepReason::kLingering;
  }
  if (!(beyond > 0)) return StepReason::kNone;
  if (input.step_needed) return StepReason::kPersistent;
  if (beyond > spec_.sure) return StepReason::kSure;
  if (beyond < spec_.beyond) return StepReason::kNone;
  const StepPlan plan = choice_.Choose(state);
  return plan.foot >= 0 && plan.margin >= 0 && plan.margin < spec_.reserve ? StepReason::kDeadline
                                                                           : StepReason::kNone;
}

double Recovery::UnloadTime() const {
  return reason_ == StepReason::kTogether ? kGently : choice_.limits().unload;
}

double Recovery::LoadTime() const {
  return reason_ == StepReason::kTogether ? kGently : spec_.load;
}

bool Recovery::TogetherNow(const StepInput& input, const StepState& state, StepPlan* plan) {
  if (!together_asked_ && !(together_at_ >= 0 && input.time >= together_at_)) {
    moving_since_ = input.time;
    return false;
  }
  if (!input.allowed || !input.in_contact[0] || !input.in_contact[1] || !AtRest(input, state)) {
    return false;
  }
  for (int foot = 0; foot < 2; ++foot) {
    const StepPlan beside = choice_.Beside(state, foot, kGently + spec_.together_swing);
    const double way = (beside.foothold - state.sole[static_cast<size_t>(foot)]).norm();
    if (way < kTogether) {
      together_asked_ = false;
      together_at_ = -1;
      return false;
    }
    // Straight rather than around the other leg.
    if (std::isfinite(beside.margin) && (plan->foot < 0 || !beside.around)) *plan = beside;
  }
  return plan->foot >= 0;
}

void Recovery::Shift(const StepInput& input, const StepState& state, double beyond) {
  const int stance = 1 - plan_.foot;
  const auto s = static_cast<size_t>(stance);
  const balance::ConvexPolygon sole =
      SoleAt(choice_.foot(stance), choice_.limits().edge, state.sole[s], state.sole_yaw[s]);
  const double over = input.time - since_;
  const bool above = over >= spec_.together_shift - kTimeTolerance &&
                     balance::Contains(sole, state.pendulum.com) &&
                     balance::Contains(sole, state.pendulum.capture_point());
  if (beyond > 0 || (!above && over > kMostShifts * spec_.together_shift)) {
    // Pushed meanwhile, or it does not get there.
    stage_ = Stage::kCatching;
    since_ = moving_since_ = input.time;
    cop_from_ = output_.cop;
  } else if (above) {
    BeginStep(input, choice_.Beside(state, plan_.foot, kGently + spec_.together_swing),
              StepReason::kTogether);
  }
}

void Recovery::BeginStep(const StepInput& input, const StepPlan& plan, StepReason reason) {
  if (plan.foot < 0 || !std::isfinite(plan.margin)) return;
  plan_ = plan;
  reason_ = reason;
  ++num_steps_;
  ++steps_now_;
  since_ = input.time;
  touch_down_ = input.time + plan.time;
  cop_from_ = output_.cop;
  ramp_from_ = 0;
  stage_ = Stage::kUnloading;
  if (!in_contact_[static_cast<size_t>(plan.foot)]) {
    const Vector2d sole = plan.foothold;
    const double ground = input.sole[static_cast<size_t>(1 - plan.foot)].translation().z();
    swing_.Begin(input.free_foot, input.free_rotation, {sole.x(), sole.y(), ground},
                 Eigen::AngleAxisd(plan.yaw, Vector3d::UnitZ()).toRotationMatrix(), input.time,
                 touch_down_, spec_.swing);
    stage_ = Stage::kSwinging;
    if (plan.around) swing_.GoAround(plan.corner);
    touch_.Reset();
  }
}

void Recovery::LiftOff(const StepInput& input) {
  const auto foot = static_cast<size_t>(plan_.foot);
  in_contact_[foot] = false;
  const Eigen::Isometry3d& sole = input.sole[foot];
  const double ground = input.sole[1 - foot].translation().z();
  swing_.Begin({.position = sole.translation()}, sole.linear(),
               {plan_.foothold.x(), plan_.foothold.y(), ground},
               Eigen::AngleAxisd(plan_.yaw, Vector3d::UnitZ()).toRotationMatrix(), input.time,
               touch_down_, spec_.swing);
  if (plan_.around) swing_.GoAround(plan_.corner);
  stage_ = Stage::kSwinging;
  since_ = input.time;
  cop_from_ = output_.cop;
  touch_.Reset();
  touched_since_ = -1;
}

double Recovery::TouchLoad(const StepInput& input) const {
  const double least = input.least_load[static_cast<size_t>(plan_.foot)];
  return std::max(spec_.touch_load, least > 0 ? std::max(least, spec_.observed_load) : 0);
}

bool Recovery::Touches(const StepInput& input) {
  if (swing_.Progress(input.time) < kLeastProgress) {
    touch_.Reset();
    return false;
  }
  if (touched_since_ < 0) {
    const double load = input.load[static_cast<size_t>(plan_.foot)];
    if (!touch_.Update(input.time, load, TouchLoad(input))) return false;
    touched_since_ = input.time;
  }
  return input.time >= touched_since_ + spec_.settle - kTimeTolerance;
}

void Recovery::Settle(const StepInput& input) {
  const auto foot = static_cast<size_t>(plan_.foot);
  const double period = std::clamp(input.time - time_, 0.0, kMaxPeriod);
  const double share = period / (kLetGo * spec_.settle + period);
  const double loaded = std::clamp(input.load[foot] / TouchLoad(input), 0.0, 1.0);
  LetGo(input.sole[foot], share, loaded, period * (1 - loaded) * spec_.swing.touch_speed,
        swing_.foothold().z() - spec_.search_depth, &output_);
}

void Recovery::Land(const StepInput& input) {
  in_contact_[static_cast<size_t>(plan_.foot)] = true;
  stage_ = Stage::kLoading;
  since_ = input.time;
  cop_from_ = output_.cop;
}

void Recovery::Swings(const StepInput& input, const StepState& state) {
  output_.searching = false;
  if (stage_ != Stage::kUnloading && stage_ != Stage::kSwinging) return;
  if (stage_ == Stage::kSwinging && touched_since_ >= 0) {
    Settle(input);
    return;
  }
  // A push takes over a foot that is under way to the other's side.
  if (reason_ == StepReason::kTogether) {
    if (!(Beyond(state) > spec_.beyond)) {
      if (stage_ == Stage::kSwinging) {
        FollowSwing(swing_, spec_.swing, spec_.search_depth, input.time, &output_);
      }
      return;
    }
    Hurry(state, input.time);
  }
  const double left = touch_down_ - input.time;
  if (left > spec_.swing.freeze) {
    const bool around = stage_ == Stage::kSwinging && swing_.around();
    const StepPlan next = choice_.At(state, plan_.foot, left, plan_.place);
    // A foothold that the way under way does not lead to is none.
    if (std::isfinite(next.margin) && (stage_ == Stage::kUnloading || around || !next.around)) {
      plan_ = next;
    }
    if (stage_ == Stage::kSwinging) swing_.Move(plan_.foothold, input.time, touch_down_);
  }
  if (stage_ == Stage::kSwinging) {
    FollowSwing(swing_, spec_.swing, spec_.search_depth, input.time, &output_);
  }
}

void Recovery::Hurry(const StepState& state, double time) {
  const double share = std::clamp((time - since_) / UnloadTime(), 0.0, 1.0);
  reason_ = StepReason::kAgain;
  if (stage_ != Stage::kUnloading) return;
  since_ = time - share * UnloadTime();
  ramp_from_ = share;
  cop_from_ = output_.cop;
  const StepPlan next = choice_.Plan(state, plan_.foot, plan_.place);
  touch_down_ = std::min(touch_down_, time + next.time - share * UnloadTime());
}

Vector2d Recovery::Goal(const StepState& state) const {
  return 0.5 * (state.sole[0] + state.sole[1]);
}

Vector2d Recovery::ForBody(const StepInput& input, double budget) const {
  // L̇ = −J (λ² lean + 2 λ turning) about the COM takes a centre of pressure (−L̇_y, L̇_x)/(m g) off.
  const Vector3d moment =
      spec_.turn_share * spec_.lean_rate * (spec_.lean_rate * input.lean + 2 * input.turning);
  const Vector2d offset(moment.y(), -moment.x());
  const double length = offset.norm();
  return length > budget ? Vector2d(budget / length * offset) : offset;
}

Vector2d Recovery::PointFor(const StepInput& input, const StepState& state,
                            const balance::ConvexPolygon& support, const Vector2d& goal,
                            const Vector2d& velocity, double budget) const {
  const Vector2d point = state.pendulum.capture_point();
  const Vector2d body = ForBody(input, budget);
  const Vector2d lead = velocity / state.pendulum.frequency;
  const bool gently = stage_ == Stage::kShifting || reason_ == StepReason::kTogether;
  const double gain = gently ? std::max(spec_.gain, kGentleGain) : spec_.gain;
  return balance::NearestPoint(support, point - lead + gain * (point - goal) + body) - body;
}

Vector2d Recovery::BrakingPoint(const StepInput& input, const StepState& state) const {
  const int stance = 1 - plan_.foot;
  const auto s = static_cast<size_t>(stance);
  if (reason_ == StepReason::kTogether) {
    return PointFor(
        input, state,
        SoleAt(choice_.foot(stance), choice_.limits().edge, state.sole[s], state.sole_yaw[s]),
        state.sole[s], Vector2d::Zero(), spec_.swing_budget);
  }
  const Vector2d body = ForBody(input, spec_.swing_budget);
  const balance::ConvexPolygon sole =
      SoleAt(choice_.foot(stance), choice_.limits().edge, state.sole[s], state.sole_yaw[s]);
  return balance::NearestPoint(sole, state.pendulum.capture_point() + body) - body;
}

Vector2d Recovery::CatchingPoint(const StepInput& input, const StepState& state) const {
  Vector2d goal = Goal(state), velocity = Vector2d::Zero();
  if (stage_ == Stage::kShifting) {
    const Vector2d way = state.sole[static_cast<size_t>(1 - plan_.foot)] - shift_from_;
    const double s = std::clamp((input.time - since_) / spec_.together_shift, 0.0, 1.0);
    goal = shift_from_ + balance::SmoothStep(s) * way;
    velocity = 30 * s * s * (1 - s) * (1 - s) / spec_.together_shift * way;
  }
  return PointFor(input, state, Soles(state, choice_.limits().edge), goal, velocity,
                  spec_.catch_budget);
}

int Recovery::FootToBring(const StepState& state) const {
  const Vector2d point = state.pendulum.capture_point();
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(-state.yaw).toRotationMatrix();
  const std::array<Vector2d, 2> offset{turn * (state.sole[0] - point),
                                       turn * (state.sole[1] - point)};
  if (choice_.reach().LowerShare(offset) < spec_.far) return -1;
  const int far = offset[0].norm() > offset[1].norm() ? 0 : 1;
  const auto near = static_cast<size_t>(1 - far);
  const balance::ConvexPolygon sole =
      SoleAt(choice_.foot(1 - far), choice_.limits().edge, state.sole[near], state.sole_yaw[near]);
  return balance::Contains(sole, point) ? far : -1;
}

bool Recovery::AtRest(const StepInput& input, const StepState& state) {
  const bool slow = input.com_velocity.norm() < spec_.rest_speed;
  const bool near = (state.pendulum.capture_point() - Goal(state)).norm() < spec_.rest_distance;
  if (!slow || !(near || Beyond(state) < -spec_.rest_distance)) moving_since_ = input.time;
  // The joints' friction holds the COM some cm beside the middle.
  return input.time >= moving_since_ + (near ? spec_.rest_time : kStill) - kTimeTolerance;
}

double Recovery::LowerShare(const StepState& state) const {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(-state.yaw).toRotationMatrix();
  std::array<Vector2d, 2> offset;
  const bool steps = stage_ == Stage::kUnloading || stage_ == Stage::kSwinging;
  // Where both soles and the COM will be.
  const Vector2d com = steps ? plan_.com : state.pendulum.com;
  for (size_t i = 0; i < 2; ++i) {
    const bool swings = steps && static_cast<int>(i) == plan_.foot;
    offset[i] = turn * ((swings ? plan_.foothold : state.sole[i]) - com);
  }
  return std::min(choice_.reach().LowerShare(offset), 1.0);
}

void Recovery::LeadCom(const StepInput& input, const StepState& state) {
  const double period = std::clamp(input.time - time_, 0.0, kMaxPeriod);
  // The height, critically damped.
  const size_t stance =
      stage_ == Stage::kShifting || stage_ == Stage::kUnloading || stage_ == Stage::kSwinging
          ? static_cast<size_t>(1 - plan_.foot)
          : static_cast<size_t>(plan_.foot);
  const double ground = input.sole[stance].translation().z();
  const double wanted = ground + standing_height_ - LowerShare(state) * choice_.reach().lower();
  height_.Follow(wanted, period);

  double share = 1;
  Vector2d cop = output_.cop;
  switch (stage_) {
    case Stage::kUnloading:
    case Stage::kSwinging:
      cop = BrakingPoint(input, state);
      if (stage_ == Stage::kUnloading) {
        share = ((input.time - since_) / UnloadTime() - ramp_from_) / (1 - ramp_from_);
      }
      break;
    case Stage::kShifting:
    case Stage::kLoading:
    case Stage::kCatching:
      cop = CatchingPoint(input, state);
      if (stage_ == Stage::kLoading) share = (input.time - since_) / LoadTime();
      break;
    case Stage::kIdle:
      break;
  }
  share = balance::SmoothStep(share);
  cop = cop_from_ + share * (cop - cop_from_);
  output_.cop = cop;
  output_.com = LeadByCop(input, height_.point(), ground, cop);
}

void Recovery::Archive(StateArchive* archive) {
  archive->Show(stage_, reason_, num_steps_, steps_now_, in_contact_);
  archive->Show(plan_.foot, plan_.time, plan_.foothold, plan_.yaw, plan_.cop, plan_.capture_point,
                plan_.com, plan_.margin, plan_.place, plan_.around, plan_.corner);
  swing_.Archive(archive);
  touch_.Archive(archive);
  height_.Archive(archive);
  archive->Show(time_, since_, ramp_from_, touched_since_, touch_down_, beyond_since_,
                lingers_since_, lingered_from_, moving_since_, cop_from_, standing_height_,
                together_asked_, together_at_, shift_from_, step_helps_);
  output_.Archive(archive);
}

}  // namespace poise::stepping
