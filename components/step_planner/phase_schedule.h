// The plan's phases in time: which one, how it ended, and how far its contact transition has come.
#pragma once

#include <optional>

#include "components/framework/state_archive.h"
#include "components/step_planner/phase_graph.h"
#include "components/step_planner/step_planner.pb.h"
#include "components/step_planner/stepping/contact_plan.h"
#include "poise/planner_status_t.hpp"

namespace poise {

using stepping::TransitionKind;

/// What holds a phase back.
enum class WaitingFor : int8_t {
  kNothing = planner_status_t::WAITING_NONE,
  /// The capture point is to be above the stance sole, before unloading or lift-off.
  kCom = planner_status_t::WAITING_COM,
  /// The foot that comes down is to be a contact, before double support.
  kContact = planner_status_t::WAITING_CONTACT,
};

/// What the robot says in one tick.
struct ScheduleInput {
  double time = 0;                                       ///< s, not decreasing
  robot::FootArray<bool> can_carry_alone{false, false};  ///< that foot alone can carry the robot
  robot::FootArray<bool> foot_confirmed{false, false};   ///< of the foot that comes down
  robot::FootArray<bool> contact_lost{false, false};     ///< a foot that is to carry does not
  bool no_surface = false;  ///< the foot that came down found none and is up again
};

struct ScheduleState {
  int phase = 0;
  bool phase_began = false;  ///< the phase's first tick
  double phase_start = 0;    ///< s, when it really began
  bool first = true;         ///< no phase has ended yet
  Outcome began_by = DONE;   ///< what the phase before came to; of no meaning in the first
  WaitingFor waiting_for = WaitingFor::kNothing;
  TransitionKind transition = TransitionKind::kNone;
  std::optional<robot::Foot> transition_foot;
  double progress = 0;  ///< 0..1

  bool waiting() const { return waiting_for != WaitingFor::kNothing; }
};

/// Pure function of the calls made so far: no clock. At most one phase begins per call.
///
/// A phase's times count from its origin: where the phase before was to end. So a plan that nothing
/// holds back does not drift by the ticks that it is made of, and one that waits goes on from
/// there.
class PhaseSchedule {
 public:
  /// `config` must have passed CheckStepPlannerConfig.
  explicit PhaseSchedule(const StepPlannerConfig& config) : config_(config), graph_(config) {}

  /// An unloading, or the lift-off after it, that is due while the other foot cannot carry waits,
  /// and with it everything later in the phase; the references under way go on, so that the COM can
  /// arrive. So waits double support until the foot that comes down is confirmed. Of several
  /// outcomes in a tick the first of CONTACT_LOST, NO_SURFACE, TIMEOUT and DONE that leads
  /// somewhere counts.
  const ScheduleState& Advance(const ScheduleInput& input);

  /// In place of Advance while another planner acts: all that is later comes later. What acts ends
  /// with both feet loaded: an unloading begins anew after it, a loading is over.
  void Hold(double time);

  /// The phase ends now, as if its time were over. False, and nothing changes, when nothing follows
  /// it or its moves are not over.
  bool EndNow(double time);

  const Phase& phase() const { return config_.phase(state_.phase); }
  /// The phase that follows when this one is done; kNone: none.
  int next() const { return graph_.Follower(state_.phase, DONE); }
  /// s until it is due, if nothing holds the phase back from now on; −1: nothing follows.
  double TimeLeft(double time) const;
  const Phase& phase(int index) const { return config_.phase(index); }
  /// The phase under way stands on one foot, the next on both.
  bool BeforeTouchDown() const;
  const ScheduleState& state() const { return state_; }
  void Archive(StateArchive* archive) {
    archive->Show(state_, began_, transition_began_, transition_start_, origin_, held_, time_);
  }

 private:
  void Begin(int phase, Outcome outcome, double time, double origin);
  /// Begins what follows an outcome other than DONE; false: none has come that leads somewhere.
  bool BeginByOutcome(const ScheduleInput& input);
  bool Unloads() const;
  bool Due(double time) const;
  /// Why the next phase, which is due, may not begin.
  WaitingFor Hindrance(const ScheduleInput& input) const;
  void AdvanceTransition(const ScheduleInput& input);
  /// All that is later in the phase comes later by `delay`, s.
  void Postpone(double delay);

  StepPlannerConfig config_;
  PhaseGraph graph_;
  ScheduleState state_;
  bool began_ = false;
  bool transition_began_ = false;
  double transition_start_ = 0;
  double origin_ = 0;  // s, from where the phase's times count
  double held_ = 0;    // s, by which waiting has moved it
  double time_ = 0;    // s, of the last call
};

}  // namespace poise
