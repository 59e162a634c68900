// The scenario's phases in time: which support, which contact transition, and how far it has come.
#pragma once

#include <array>

#include "components/framework/state_archive.h"
#include "components/task_controller/task_controller.pb.h"

namespace poise {

/// Throws ConfigError naming the field ("phase[2].duration") of a schedule or gain that cannot
/// work.
void CheckTaskControllerConfig(const TaskControllerConfig& config);

/// Feet in contact, right first.
std::array<bool, 2> ContactsOf(Support support);

enum class TransitionKind { kNone, kUnloading, kLoading };

/// What holds the schedule back.
enum class WaitingFor {
  kNothing,
  kCom,      ///< to stand above the stance sole, before unloading or lift-off
  kContact,  ///< of the foot that comes down, before double support
};

struct ScheduleState {
  int phase = 0;
  bool phase_began = false;  ///< the phase's first tick
  double phase_start = 0;    ///< s, when it really began
  WaitingFor waiting_for = WaitingFor::kNothing;
  TransitionKind transition = TransitionKind::kNone;
  int transition_foot = -1;
  double progress = 0;  ///< 0..1

  bool waiting() const { return waiting_for != WaitingFor::kNothing; }
};

/// Pure function of the calls made so far: no clock. At most one phase begins per call.
class PhaseSchedule {
 public:
  /// `config` must have passed CheckTaskControllerConfig.
  explicit PhaseSchedule(const TaskControllerConfig& config) : config_(config) {}

  /// `time` in s, not decreasing; `com_over_foot`: that foot alone can carry the robot. An
  /// unloading, or the lift-off after it, that is due while the other foot cannot waits, and with
  /// it everything later in the schedule; the references of the phase under way go on, so that the
  /// COM can arrive. So waits double support, when contact.required, until `foot_confirmed` of the
  /// foot that comes down.
  const ScheduleState& Advance(double time, const std::array<bool, 2>& com_over_foot,
                               const std::array<bool, 2>& foot_confirmed);

  const Phase& phase() const { return config_.phase(state_.phase); }
  /// The phase under way stands on one foot, the next on both.
  bool BeforeTouchDown() const;
  const ScheduleState& state() const { return state_; }
  void Archive(StateArchive* archive) {
    archive->Show(state_, began_, transition_began_, transition_start_, shift_);
  }

 private:
  bool Unloads() const;
  /// Why the next phase, which is due, may not begin.
  WaitingFor Hindrance(const std::array<bool, 2>& com_over_foot,
                       const std::array<bool, 2>& foot_confirmed) const;
  void AdvanceTransition(double time, const std::array<bool, 2>& com_over_foot);

  TaskControllerConfig config_;
  ScheduleState state_;
  bool began_ = false;
  bool transition_began_ = false;
  double transition_start_ = 0;
  double shift_ = 0;  // s, by which waiting has moved the schedule
};

}  // namespace poise
