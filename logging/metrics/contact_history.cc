#include "logging/metrics/contact_history.h"

#include <cmath>

#include "logging/metrics/schedule_plan.h"

namespace poise::logging {
namespace {

// m from its reference's end, beyond which a contact is reported as early or late.
constexpr double kExpectedWithin = 0.02;

std::array<bool, 2> Contacts(const std::vector<int8_t>& in_contact) {
  return {in_contact[0] != 0, in_contact[1] != 0};
}

double Height(const planner_status_t& planner, size_t foot) {
  return planner.foot_pose[foot].position[2];
}

/// Follows where each foot's reference is to end before both feet are to stand, phase by phase.
class ReferenceEnds {
 public:
  explicit ReferenceEnds(const RunRecord& run) : schedule_(ReadSchedulePlan(run)) {}

  void Update(const planner_status_t& planner, const support_plan_t& plan) {
    if (planner.phase == phase_) return;
    phase_ = planner.phase;
    if (!schedule_ || phase_ < 0 || static_cast<size_t>(phase_) >= schedule_->size()) return;
    std::array<double, 2> level{plan.foot_reference[0].position[2],
                                plan.foot_reference[1].position[2]};
    int at = phase_;
    // Phases are taken as they follow each other when all goes well; a plan may go round in
    // circles.
    for (size_t steps = 0; at >= 0 && steps < schedule_->size(); ++steps) {
      const PhasePlan& phase = (*schedule_)[static_cast<size_t>(at)];
      if (at != phase_ && phase.double_support) break;
      const bool now = steps == 0;
      at = phase.next;
      if (!phase.foot) continue;
      const auto f = static_cast<size_t>(phase.foot->foot);
      if (phase.foot->above_support) {
        level[f] = Height(planner, 1 - f) + phase.foot->z;
      } else if (!(now && phase.foot->at_once)) {  // else it stands there already
        level[f] += phase.foot->z;
      }
      end_[f] = level[f];
    }
  }
  void Place(const planner_status_t& planner, TouchDown* touch) const {
    if (!end_[touch->foot]) return;
    touch->above_end = Height(planner, touch->foot) - *end_[touch->foot];
    touch->timing = *touch->above_end > kExpectedWithin    ? Timing::kEarly
                    : *touch->above_end < -kExpectedWithin ? Timing::kLate
                                                           : Timing::kExpected;
  }

 private:
  std::optional<std::vector<PhasePlan>> schedule_;
  int32_t phase_ = -1;
  std::array<std::optional<double>, 2> end_;
};

}  // namespace

std::string FootName(const RunRecord& run, size_t foot) {
  return run.robot.feet()[foot].name + " foot";
}

std::string SupportName(const RunRecord& run, const std::array<bool, 2>& contacts) {
  if (contacts[0] && contacts[1]) return "both feet";
  if (!contacts[0] && !contacts[1]) return "no foot";
  return FootName(run, contacts[0] ? 0 : 1);
}

std::vector<SupportChange> SupportChanges(const RunRecord& run) {
  std::vector<SupportChange> changes;
  for (int64_t tick = 1; tick < run.num_ticks; ++tick) {
    const joint_command_t* before = run.command.at(tick - 1);
    const joint_command_t* now = run.command.at(tick);
    if (before == nullptr || now == nullptr) continue;
    SupportChange change{tick, Contacts(before->in_contact), Contacts(now->in_contact)};
    if (change.before == change.after) continue;
    for (size_t joint = 0; joint < now->torque.size(); ++joint) {
      const double step = std::abs(now->torque[joint] - before->torque[joint]);
      if (step > change.torque_step) {
        change.torque_step = step;
        change.joint = joint;
      }
    }
    changes.push_back(change);
  }
  return changes;
}

std::vector<TouchDown> TouchDowns(const RunRecord& run) {
  std::vector<TouchDown> touches;
  ReferenceEnds ends(run);
  const planner_status_t* before = nullptr;
  std::array<bool, 2> down{};  // a sole that bounces touches down once
  for (const auto& [tick, planner] : Messages(run.planner, 0, run.num_ticks)) {
    if (const support_plan_t* plan = run.plan.at(tick)) ends.Update(*planner, *plan);
    for (size_t foot = 0; before != nullptr && foot < 2; ++foot) {
      const int8_t was = before->foot_state[foot], is = planner->foot_state[foot];
      const bool off =
          was != planner_status_t::FOOT_SUPPORT && was != planner_status_t::FOOT_TOUCHING;
      // A recovery's foot goes from a swing straight to support: it is a contact from its first
      // load on.
      const bool confirmed =
          is == planner_status_t::FOOT_TOUCHING ||
          (is == planner_status_t::FOOT_SUPPORT && was == planner_status_t::FOOT_SEARCHING);
      if (was == planner_status_t::FOOT_SUPPORT) down[foot] = false;
      if (!off || !confirmed || down[foot]) continue;
      down[foot] = true;
      TouchDown touch{tick, foot, Height(*planner, foot) - Height(*planner, 1 - foot), {}};
      ends.Place(*planner, &touch);
      touches.push_back(touch);
    }
    before = planner;
  }
  return touches;
}

std::optional<bool> ContactLost(const RunRecord& run, size_t foot, int64_t tick) {
  const joint_command_t* command = run.command.at(tick - 1);
  if (command == nullptr || command->in_contact[foot] == 0) return {};
  const double weight = run.robot.total_mass() * robot::kGravity;
  if (-command->foot_wrench[foot].force[2] < kLoadedShare * weight) return {};
  const robot_state_t* state = run.state.at(tick);
  const bool observed = state != nullptr && foot < state->foot_wrench_source.size() &&
                        state->foot_wrench_source[foot] == robot_state_t::SOURCE_OBSERVER;
  const double noise =
      observed ? state->foot_wrench_deviation[foot].force[2] : LeastReadLoad(run.robot);
  const auto wrench = KnownWrench(run, foot, tick);
  if (!wrench) return {};
  return -(*wrench)[2] <= noise;
}

std::vector<Interval> Intervals(const RunRecord& run,
                                const std::function<std::optional<bool>(int64_t)>& holds,
                                int64_t gap) {
  std::vector<Interval> intervals;
  bool on = false;
  for (int64_t tick = 0; tick < run.num_ticks; ++tick) {
    const bool now = holds(tick).value_or(on);
    if (now && !on) {
      const bool bridged = !intervals.empty() && tick - *intervals.back().end <= gap;
      if (bridged) {
        intervals.back().end.reset();
      } else {
        intervals.push_back({tick, {}});
      }
    }
    if (!now && on) intervals.back().end = tick;
    on = now;
  }
  return intervals;
}

}  // namespace poise::logging
