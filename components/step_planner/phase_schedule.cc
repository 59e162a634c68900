#include "components/step_planner/phase_schedule.h"

#include <algorithm>

#include "components/framework/tick_time.h"

namespace poise {
namespace {

using robot::Foot;

}  // namespace

const ScheduleState& PhaseSchedule::Advance(const ScheduleInput& input) {
  const double time = input.time;
  state_.phase_began = false;
  WaitingFor hindrance = WaitingFor::kNothing;
  if (!began_) {
    began_ = true;
    // The run's lead, at negative times, counts for nothing.
    Begin(0, DONE, time, std::max(time, 0.0));
    state_.first = true;
  } else if (!BeginByOutcome(input) && Due(time)) {
    hindrance = Hindrance(input);
    if (hindrance == WaitingFor::kNothing) {
      Begin(next(), DONE, time, origin_ + phase().duration());
    } else {
      Postpone(std::max(0.0, time - phase().duration() - origin_));
    }
  }
  AdvanceTransition(input);
  time_ = time;
  if (hindrance != WaitingFor::kNothing) state_.waiting_for = hindrance;
  return state_;
}

void PhaseSchedule::Begin(int phase, Outcome outcome, double time, double origin) {
  state_.phase = phase;
  state_.phase_began = true;
  state_.phase_start = time;
  state_.first = false;
  state_.began_by = outcome;
  transition_began_ = false;
  origin_ = origin;
  held_ = 0;
}

bool PhaseSchedule::BeginByOutcome(const ScheduleInput& input) {
  const auto begin = [&](Outcome outcome, Foot foot) {
    const int follower = graph_.Follower(state_.phase, outcome, foot);
    if (follower == PhaseGraph::kNone) return false;
    Begin(follower, outcome, input.time, input.time);
    return true;
  };
  for (const Foot foot : robot::kFeet) {
    if (input.contact_lost[foot] && begin(CONTACT_LOST, foot)) return true;
  }
  if (input.no_surface && begin(NO_SURFACE, Foot::kRight)) return true;
  return phase().has_timeout() && held_ >= phase().timeout() - kTimeTolerance &&
         begin(TIMEOUT, Foot::kRight);
}

void PhaseSchedule::Hold(double time) {
  const double delay = std::max(0.0, time - time_);
  time_ = time;
  origin_ += delay;
  state_.phase_began = false;
  state_.transition = TransitionKind::kNone;
  state_.transition_foot.reset();
  state_.progress = 0;
  if (!phase().has_transition()) return;
  // Steps end with both feet loaded: an unloading begins anew from there, a loading is over.
  const ContactTransition& transition = phase().transition();
  if (!Unloads()) {
    transition_began_ = true;
    transition_start_ = time - transition.duration() - kTimeTolerance;
  } else if (transition_began_) {
    transition_start_ = time;
    origin_ = time - transition.delay();
  }
}

bool PhaseSchedule::EndNow(double time) {
  const Phase& p = phase();
  if (!began_ || next() == PhaseGraph::kNone || (Unloads() && !transition_began_)) return false;
  double moves = p.com().delay() + p.com().duration();
  moves = std::max(moves, p.body().delay() + p.body().duration());
  moves = std::max(moves, p.foot().delay() + p.foot().duration());
  moves = std::max(moves, p.foot().turn().delay() + p.foot().turn().duration());
  if (p.has_transition()) {
    moves = std::max(moves, p.transition().delay() + p.transition().duration());
  }
  if (time < origin_ + moves - kTimeTolerance) return false;
  origin_ = std::min(origin_, time - p.duration());
  return true;
}

void PhaseSchedule::Postpone(double delay) {
  origin_ += delay;
  held_ += delay;
}

bool PhaseSchedule::Due(double time) const {
  return next() != PhaseGraph::kNone && !(Unloads() && !transition_began_) &&
         time >= origin_ + phase().duration() - kTimeTolerance;
}

double PhaseSchedule::TimeLeft(double time) const {
  if (next() == PhaseGraph::kNone) return -1;
  return std::max(0.0, origin_ + phase().duration() - time);
}

bool PhaseSchedule::BeforeTouchDown() const {
  return phase().support() != DOUBLE && next() != PhaseGraph::kNone &&
         config_.phase(next()).support() == DOUBLE;
}

bool PhaseSchedule::Unloads() const {
  return phase().has_transition() && phase().transition().kind() == ContactTransition::UNLOAD;
}

WaitingFor PhaseSchedule::Hindrance(const ScheduleInput& input) const {
  // The ramp has ended by then: CheckStepPlannerConfig sees to that.
  if (Unloads() && !input.can_carry_alone[Other(robot::FootAt(phase().transition().foot()))]) {
    return WaitingFor::kCom;
  }
  if (BeforeTouchDown()) {
    const Foot foot = phase().support() == RIGHT ? Foot::kLeft : Foot::kRight;
    if (!input.foot_confirmed[foot]) return WaitingFor::kContact;
  }
  return WaitingFor::kNothing;
}

void PhaseSchedule::AdvanceTransition(const ScheduleInput& input) {
  state_.waiting_for = WaitingFor::kNothing;
  state_.transition = TransitionKind::kNone;
  state_.transition_foot.reset();
  state_.progress = 0;
  if (!phase().has_transition()) return;

  const ContactTransition& transition = phase().transition();
  const bool unloading = transition.kind() == ContactTransition::UNLOAD;
  const double due = origin_ + transition.delay();
  if (!transition_began_) {
    const bool is_due = input.time >= due - kTimeTolerance;
    if (is_due && unloading && !input.can_carry_alone[Other(robot::FootAt(transition.foot()))]) {
      state_.waiting_for = WaitingFor::kCom;
      Postpone(input.time - due);
      return;
    }
    if (is_due) {
      transition_began_ = true;
      transition_start_ = due;
    } else if (unloading) {
      return;
    }
  }
  // A foot that is to be loaded carries nothing from the phase's start until the ramp begins.
  if (transition_began_) {
    const double elapsed = std::max(0.0, input.time - transition_start_);
    state_.progress = transition.duration() > kTimeTolerance
                          ? std::min(1.0, elapsed / transition.duration() + kTimeTolerance)
                          : 1.0;
  }
  if (!unloading && state_.progress >= 1.0) {
    state_.progress = 0;
    return;
  }
  state_.transition = unloading ? TransitionKind::kUnloading : TransitionKind::kLoading;
  state_.transition_foot = robot::FootAt(transition.foot());
}

}  // namespace poise
