#include "components/step_planner/stepping/quasi_static_walk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "components/balance/minimum_jerk.h"

namespace poise::stepping {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kHalvings = 40;  // of [0, 1]
// m that told ground is higher to be an edge that the foot rises over, and the share of the swing
// in which it only rises then: on unknown ground 0.15 is enough, told ground is an edge for
// certain.
constexpr double kStepUpHeight = 0.03, kStepUpWait = 0.25;
// Times the unloading's rate, at least and at most: the ramp goes on however far the centre of
// pressure is, and comes up with it. A foot that carries nothing and is a contact of the model
// still was dragged off its place.
constexpr double kSlowestUnload = 0.1, kFastestUnload = 3;
// Share of a straight leg, to which it is stretched at most. Fitted: 0.9 and 0.94 fall as seldom,
// 0.97 and 0.86 more often; with 0.97 the knee of a foot that is about to leave the ground came to
// be straight.
constexpr double kStretched = 0.92;
// 1/s with which is observed what legs and body add to the pendulum. A sole on 20 kN/m rolls at
// some 4 Hz, and a faster observer stirs it: with 10 it grew to 30 degrees.
constexpr double kOffsetRate = 5;
// Ratio: how much longer a swing lasts at most above a sole that has sunk. One on 2 kN/m takes a
// centre of pressure 35 mm off its middle along it, and 10 mm across.
constexpr double kSlowestSwing = 2.5;
constexpr double kBlend = 0.1;  // s in which the centre of pressure goes over to another stage's

}  // namespace

QuasiStaticWalk::QuasiStaticWalk(const StepChoice& choice, const QuasiStaticSpec& spec)
    : choice_(choice),
      spec_(spec),
      foot_(spec.landing),
      height_(spec.height_rate),
      heading_(spec.yaw_rate),
      pressed_(spec.height_rate),
      sole_{SoleMemory(choice.foot(Foot::kRight)), SoleMemory(choice.foot(Foot::kLeft))},
      ramp_start_(RampStart(kPressShare)) {}

double RampStart(double share) {
  double low = 0, high = 1;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (balance::SmoothStep(middle) < share ? low : high) = middle;
  }
  return low;
}

void QuasiStaticWalk::Enter(Stage stage, double time) {
  if (stage == Stage::kUnloading) {
    unloaded_ = 0;
    PlanSteps(steps_.first().at, time);
  }
  stage_ = stage;
  since_ = time;
}

void QuasiStaticWalk::PlanSteps(const Foothold& first, double unload) {
  constexpr int kPlanned = 3;
  Footstep step{.foot = Other(stance_), .at = first, .unload = unload};
  steps_.Clear();
  for (int i = 0; i < kPlanned; ++i) {
    step.lift_off = step.unload + ramp_slowdown_ * spec_.unload;
    step.touch_down = step.lift_off + SwingTime();
    step.load = step.touch_down + spec_.landing.settle + ramp_slowdown_ * spec_.load;
    steps_.Add(step);
    step.unload = step.load;
    step.foot = Other(step.foot);
    step.at = Next(step.at, step.foot);
  }
}

Foothold QuasiStaticWalk::Next(const Foothold& stance, Foot foot) const {
  return NextFootstep(stance, foot, command_, spec_.period(), spec_.step);
}

Foothold QuasiStaticWalk::NextOnCourse(const Foothold& stance, Foot foot) const {
  return Towards(Next(stance, foot), Next(course_, foot), spec_.most_return, stance, foot,
                 spec_.step);
}

bool QuasiStaticWalk::LiftsOff(const StepState& state, double time) const {
  if (time < since_ + ramp_slowdown_ * spec_.unload - kTimeTolerance) return false;
  if (unloaded_ < 1) return false;
  const Vector2d off = state.pendulum.capture_point() - state.sole[stance_];
  return off.norm() < spec_.lift_off_distance;
}

bool QuasiStaticWalk::OnSoftGround() const {
  return std::max(sole_[0].sinks(), sole_[1].sinks()) > spec_.soft;
}

bool QuasiStaticWalk::AtRest(const StepInput& input, const StepState& state) {
  const Vector2d middle = 0.5 * (state.sole[0] + state.sole[1]);
  const bool still = (state.pendulum.capture_point() - middle).norm() < spec_.still_distance &&
                     input.com_velocity.norm() < spec_.still_speed;
  if (!still) moving_since_ = input.time;
  return input.time >= moving_since_ + spec_.still_time - kTimeTolerance;
}

bool QuasiStaticWalk::Update(const StepInput& input, const WalkCommand& command) {
  const double time = input.time;
  StepState state = Observe(input, active() ? in_contact_ : input.in_contact);
  switch (stage_) {
    case Stage::kStanding:
      if (!command.stepping || !input.allowed || !(input.in_contact[0] && input.in_contact[1])) {
        time_ = time;
        return false;
      }
      Start(input, state, command);
      break;
    case Stage::kShifting:
      if (time >= since_ + spec_.start - kTimeTolerance) Enter(Stage::kUnloading, time);
      break;
    case Stage::kUnloading:
      Unload(state, TickPeriod(time - time_));
      if (LiftsOff(state, time)) BeginSwing(input);
      break;
    case Stage::kSwinging:
    case Stage::kTouching: {
      const Foot foot = Other(stance_);
      const bool lands = foot_.Update(input, foot, choice_.foot(foot));
      if (stage_ == Stage::kSwinging && foot_.state() == Landing::State::kTouching) {
        sole_[foot].Touch(input.sole[foot]);
        Enter(Stage::kTouching, time);
      }
      if (lands) Land(input, state, command);
      break;
    }
    case Stage::kLoading:
      if (time < since_ + ramp_slowdown_ * spec_.load - kTimeTolerance) break;
      moving_since_ = time;
      Enter(steps_.empty() ? Stage::kCatching : Stage::kUnloading, time);
      break;
    case Stage::kCatching:
      if (!AtRest(input, state) || (OnSoftGround() && !command.stepping)) break;
      Enter(Stage::kStanding, time);
      time_ = time;
      return false;
  }
  state.in_contact = in_contact_;
  Lead(input, state);
  time_ = time;
  return true;
}

void QuasiStaticWalk::Start(const StepInput& input, const StepState& state,
                            const WalkCommand& command) {
  command_ = Approach({}, command, kAcceleration * spec_.period(),
                      spec_.turn_acceleration * spec_.period());
  starting_ = true;
  stance_ = Other(FirstFoot(command));
  in_contact_ = {true, true};
  for (const Foot foot : kFeet) sole_[foot].Touch(input.sole[foot]);
  ramp_slowdown_ = 1;
  double ground = input.sole[0].translation().z();
  if (!spec_.ground.empty()) ground = std::min(ground, input.sole[1].translation().z());
  if (!lowered_) standing_height_ = input.com_height - ground;
  lowered_ = false;
  height_.Begin(input.com_height);
  heading_.Begin(state.yaw);
  course_ = {state.sole[stance_], state.sole_yaw[stance_]};
  PlanSteps(Next(course_, Other(stance_)), input.time + spec_.start);
  cop_jump_.setZero();
  offset_.setZero();
  predicted_capture_point_ = state.pendulum.capture_point();
  Enter(Stage::kShifting, input.time);
  start_ = {state.pendulum.capture_point(), input.time, spec_.start + spec_.unload};
}

void QuasiStaticWalk::BeginSwing(const StepInput& input) {
  const Foot foot = Other(stance_);
  in_contact_[foot] = false;
  starting_ = false;
  PlanSteps(steps_.first().at, input.time - ramp_slowdown_ * spec_.unload);
  const Footstep& step = steps_.first();
  pressed_.Begin(0);
  const double ground = GroundAt(input, step.at);
  SwingSpec way = spec_.foot;
  // Up before an edge that it is told of, not against it.
  if (!spec_.ground.empty() && ground > input.sole[foot].translation().z() + kStepUpHeight) {
    way.wait = std::max(way.wait, kStepUpWait);
  }
  // It is searched for as deep below where the stance sole stands as below what that met.
  foot_.LiftOff({.position = input.sole[foot].translation()}, input.sole[foot].linear(), step,
                ground, ground - Sunk(input), way, input.time);
  Enter(Stage::kSwinging, input.time);
}

double QuasiStaticWalk::Sunk(const StepInput& input) const {
  const Foot s = stance_;
  return spec_.ground.empty() ? sole_[s].Sunk(input.sole[s]) : 0;
}

double QuasiStaticWalk::GroundAt(const StepInput& input, const Foothold& foothold) const {
  const Vector3d stance = input.sole[stance_].translation();
  if (spec_.ground.empty()) return stance.z() + Sunk(input);
  // From sole to sole: what the estimator's height drifts by does not count.
  return stance.z() + spec_.ground.At(Other(stance_), foothold.position.x()) -
         spec_.ground.At(stance_, stance.x());
}

double QuasiStaticWalk::Loaded(const StepInput& input) const {
  return std::clamp(input.load[Other(stance_)] / spec_.landing.press_load, 0.0, 1.0);
}

void QuasiStaticWalk::Land(const StepInput& input, const StepState& state,
                           const WalkCommand& command) {
  ++num_landed_;
  in_contact_ = {true, true};
  const Foot foot = Other(stance_);
  sole_[foot].Expect(input.sole[foot], input.load[foot], spec_.weight, spec_.most_sinking);
  const double haste = kSinkSpeed * (spec_.load + spec_.unload);
  ramp_slowdown_ = std::max(sole_[foot].sinks() / haste, 1.0);
  course_ = Next(course_, foot);
  stance_ = foot;
  steps_.Land(input.time, input.time + ramp_slowdown_ * spec_.load);
  Enter(Stage::kLoading, input.time);
  command_ = Approach(command_, command, kAcceleration * spec_.period(),
                      spec_.turn_acceleration * spec_.period());
  if (command_.stepping) {
    PlanSteps(NextOnCourse({state.sole[stance_], state.sole_yaw[stance_]}, Other(stance_)),
              steps_.landed().load);
  } else {
    // It stops as it stands: beside a foot on unknown ground, or on stairs, may be an edge.
    steps_.Clear();
  }
}

StepStatus QuasiStaticWalk::status() const {
  const bool landed = steps_.empty() || stage_ == Stage::kLoading;
  return {.stage = stage_,
          .reason = StepReason::kWalk,
          .under_way = !landed,
          .step = landed ? steps_.landed() : steps_.first()};
}

double QuasiStaticWalk::HighestForStep(const StepInput& input, const StepState& state) const {
  const bool steps = stage_ == Stage::kUnloading || OnOneFoot();
  if (!steps) return std::numeric_limits<double>::infinity();
  const Foot s = stance_;
  FootArray<Vector2d> offset{Vector2d::Zero(), Vector2d::Zero()};
  offset[Other(s)] = Eigen::Rotation2Dd(-state.yaw) * (steps_.first().at.position - state.sole[s]);
  const double share = std::min(choice_.reach().LoweringShare(offset), 1.0);
  return GroundAt(input, steps_.first().at) + standing_height_ - share * choice_.reach().lowering();
}

double QuasiStaticWalk::Progress(double time) const {
  const double past = time - since_;
  if (stage_ == Stage::kUnloading) return unloaded_;
  // From what the press carries.
  return std::clamp(ramp_start_ + (1 - ramp_start_) * past / (ramp_slowdown_ * spec_.load), 0.0,
                    1.0);
}

void QuasiStaticWalk::Unload(const StepState& state, double period) {
  const Vector2d& stance = state.sole[stance_];
  const Vector2d way = state.sole[Other(stance_)] - stance;
  // The centre of pressure still has this share of the way to the sole that shall carry.
  const double left = std::max(0.0, (output_.cop - stance).dot(way) / way.squaredNorm());
  const double share =
      spec_.load_lead < left * way.norm() ? spec_.load_lead / (left * way.norm()) : 1;
  const double step = period / (ramp_slowdown_ * spec_.unload),
               most = share < 1 ? RampStart(share) : 1;
  unloaded_ = std::min(
      1.0, unloaded_ + std::clamp(most - unloaded_, kSlowestUnload * step, kFastestUnload * step));
}

balance::ConvexPolygon QuasiStaticWalk::Carrying(const StepInput& input, const StepState& state,
                                                 const Vector2d& cop) const {
  const Foot s = stance_, o = Other(s);
  const balance::ConvexPolygon sole = choice_.Sole(state, s);
  if (OnOneFoot()) return sole;
  const balance::ConvexPolygon other = choice_.Sole(state, o);
  if (stage_ == Stage::kShifting || stage_ == Stage::kCatching) return HullOf(sole, other);
  // Free of the ramp the load goes to the feet as the centre of pressure lies between them.
  const Vector2d way = state.sole[s] - state.sole[o];
  const double free = std::clamp((cop - state.sole[o]).dot(way) / way.squaredNorm(), 0.0, 1.0);
  const bool loading = stage_ == Stage::kLoading;
  const double ramp = balance::SmoothStep(Progress(input.time));
  const double share = loading ? ramp * free : free + ramp * (1 - free);
  // Corner for corner: all of the sum of two equal soles, a part of it where one is turned.
  const auto corners = std::min(sole.corners().size(), other.corners().size());
  std::array<Vector2d, balance::ConvexPolygon::kMaxCorners> mixed;
  for (size_t i = 0; i < corners; ++i) {
    mixed[i] = share * sole.corner[i] + (1 - share) * other.corner[i];
  }
  return balance::ConvexHull({mixed.data(), corners});
}

CaptureReference QuasiStaticWalk::Wanted(const StepState& state, double time) const {
  const Vector2d& stance = state.sole[stance_];
  const Vector2d& other = state.sole[Other(stance_)];
  if (starting_) return start_.At(time, stance);
  const double pressed = pressed_.point().position, pressing = pressed_.point().velocity;
  if (OnOneFoot()) {
    const Vector2d way = other - stance;
    return {stance + pressed * way, pressing * way};
  }
  const Vector2d way = (steps_.empty() ? Vector2d(0.5 * (stance + other)) : stance) - other;
  // Minimum jerk: the centre of pressure goes towards the outer edge at first, never beyond the
  // next middle.
  const balance::MinimumJerk gone(time - steps_.landed().touch_down, Transfer());
  const double share = pressed + (1 - pressed) * gone.position;
  const double rate = pressing * (1 - gone.position) + (1 - pressed) * gone.speed;
  return {other + share * way, rate * way};
}

Vector2d QuasiStaticWalk::DesiredCop(const StepInput& input, const StepState& state) {
  const double time = input.time;
  wanted_ = Wanted(state, time);
  const balance::ConvexPolygon carrying =
      Carrying(input, state, wanted_.Cop(state.pendulum.frequency));
  const Vector2d asked = LeadingCop(state.pendulum, wanted_, kGain, carrying);
  // A foot that lands at another time than planned makes no step of it.
  if (since_ == time && stage_ != Stage::kShifting) cop_jump_ = output_.cop - asked;
  const double left = 1 - balance::SmoothStep((time - since_) / kBlend);
  return balance::NearestPoint(carrying, asked + left * cop_jump_);
}

double QuasiStaticWalk::SwingTime() const {
  const double sinks = sole_[stance_].sinks();
  if (!(sinks > spec_.soft)) return spec_.swing;
  return spec_.swing * std::min(std::sqrt(sinks / spec_.soft), kSlowestSwing);
}

bool QuasiStaticWalk::Lost(const StepInput& input) const {
  if (!OnOneFoot()) return false;
  const StepState state = Observe(input, in_contact_);
  return -balance::SignedDistance(choice_.Soles(state, 0), state.pendulum.capture_point()) > 0;
}

Vector2d QuasiStaticWalk::WithoutOffset(const StepState& state, const Vector2d& cop,
                                        double period) {
  // Two poles at the rate.
  const double rate = kOffsetRate;
  const double w = state.pendulum.frequency;
  const Vector2d error = state.pendulum.capture_point() - predicted_capture_point_;
  const Vector2d asked = cop - offset_;
  predicted_capture_point_ +=
      period * (w * (predicted_capture_point_ + error - asked - offset_) + 2 * rate * error);
  offset_ = (offset_ - period * rate * rate / w * error)
                .cwiseMax(-spec_.most_offset)
                .cwiseMin(spec_.most_offset);
  return asked;
}

double QuasiStaticWalk::StillSinks(const StepInput& input) {
  const Foot s = stance_;
  const double load = input.load[s];
  if (load > spec_.landing.press_load) sole_[s].Correct(input.sole[s], load, spec_.weight);
  const double left = sole_[s].sinks() * std::clamp(1 - load / spec_.weight, 0.0, 1.0);
  return std::min(left, spec_.most_ahead);
}

double QuasiStaticWalk::Height(const StepInput& input, const StepState& state) {
  const Foot s = stance_, o = Other(s);
  const double lower = stage_ == Stage::kCatching ? 0 : spec_.com_lowering;
  const double stance = input.sole[s].translation().z(), other = input.sole[o].translation().z();
  // Before it sinks: its leg would be stretched.
  const double low = stance - StillSinks(input);
  const bool feels = stage_ != Stage::kSwinging || foot_.state() == Landing::State::kSearching;
  // Above the lower foot: a straight leg reaches no farther down.
  const double height = (feels ? std::min(low, other) : low) + standing_height_ - lower;
  const bool shifts = stage_ == Stage::kLoading || stage_ == Stage::kUnloading;
  if (!shifts || !(sole_[s].sinks() > spec_.soft)) return height;
  // While a foot sinks, above the higher one as far as the lower one's leg reaches: the ankle of a
  // leg that is bent above its sole comes to its limit first.
  double highest = std::max(stance, other) + standing_height_ - lower;
  for (const Foot i : kFeet) {
    const Vector2d offset = Eigen::Rotation2Dd(-state.yaw) * (state.sole[i] - input.com.head<2>());
    const double leg = choice_.legs().Highest(i, offset, kStretched);
    highest = std::min(highest, (i == s ? low : other) + std::min(leg, standing_height_));
  }
  return std::max(height, highest);
}

void QuasiStaticWalk::Lead(const StepInput& input, const StepState& state) {
  const double period = TickPeriod(input.time - time_);
  // A foot that is pressed carries: the sole of the other one shall do so by its middle still.
  const bool presses = stage_ == Stage::kTouching;
  const double share = stage_ == Stage::kSwinging ? 0 : presses ? Loaded(input) : 1;
  pressed_.Follow(share * kPressShare, period);
  const Foot s = stance_;
  double height = Height(input, state);
  if (!spec_.ground.empty()) height = std::min(height, HighestForStep(input, state));
  height_.Follow(height, period);
  heading_.Follow(state.sole_yaw[s], OnOneFoot() ? steps_.first().at.yaw : state.sole_yaw[Other(s)],
                  period);
  const Vector2d cop = DesiredCop(input, state);
  output_.cop = cop;
  output_.cop_reference << WithoutOffset(state, cop, period), input.sole[s].translation().z();
  output_.com = LeadByCop(input, height_.point(), output_.cop_reference);
  output_.in_contact = in_contact_;
  output_.Follow(foot_);
  output_.transition = TransitionOf(stage_);
  output_.foot = stage_ == Stage::kLoading ? stance_ : Other(stance_);
  output_.progress = output_.transition == TransitionKind::kNone ? 0 : Progress(input.time);
}

void QuasiStaticWalk::Archive(StateArchive* archive) {
  archive->Show(stage_, command_, stance_, num_landed_, in_contact_, steps_, foot_, height_,
                heading_, pressed_, sole_, ramp_slowdown_, time_, since_, moving_since_,
                standing_height_, starting_, course_, unloaded_, lowered_, start_, wanted_,
                cop_jump_, predicted_capture_point_, offset_, output_);
}

}  // namespace poise::stepping
