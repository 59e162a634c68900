#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fmt/format.h"
#include "logging/events/bridge_words.h"
#include "logging/events/event_groups.h"
#include "logging/metrics/analysis.h"
#include "logging/metrics/contact_history.h"

namespace poise::logging {
namespace {

constexpr double kLimitGap = 0.1;  // s between two limits of a motor that are one

/// A limit of the bridge that changed what a controller wanted of a joint.
struct MotorLimit {
  int bit;
  const char *begins, *ends;
};
constexpr MotorLimit kMotorLimits[] = {
    {bridge_status_t::LIMIT_TORQUE, "motor_limited", "motor_limited_ends"},
    {bridge_status_t::LIMIT_THERMAL, "motor_hot", "motor_hot_ends"},
    {bridge_status_t::LIMIT_IMPEDANCE, "impedance_cut", "impedance_cut_ends"},
};

/// N·m that the command wants of a joint, with its stiffness and damping at the estimated joint.
Answer WantedTorque(const RunRecord& run, int64_t tick, size_t joint) {
  const joint_command_t* const command = run.command.at(tick);
  const robot_state_t* const state = run.state.at(tick);
  if (command == nullptr || joint >= command->torque.size()) return {};
  if (command->stiffness[joint] == 0 && command->damping[joint] == 0) return command->torque[joint];
  if (state == nullptr) return {};
  return command->torque[joint] +
         command->stiffness[joint] * (command->position[joint] - state->joint_position[joint]) +
         command->damping[joint] * (command->velocity[joint] - state->joint_velocity[joint]);
}

/// Empty where the log does not say.
std::optional<ImpedanceCut> CutAt(const RunRecord& run, int64_t tick, size_t joint) {
  const joint_command_t* const command = run.command.at(tick);
  const drive_command_t* const drive = run.drive.at(tick);
  if (command == nullptr || drive == nullptr || joint >= command->stiffness.size() ||
      joint >= drive->stiffness.size()) {
    return {};
  }
  return CutOf(*command, *drive, joint);
}

/// A cut that nobody notices.
bool IsRounding(const RunRecord& run, int64_t tick, size_t joint) {
  const std::optional<ImpedanceCut> cut = CutAt(run, tick, joint);
  return cut && !cut->counts();
}

/// "left_knee_pitch: stiffness cut from 900 to 600 N·m/rad", of the interval's largest cut.
std::string CutText(const RunRecord& run, size_t joint, const Interval& interval) {
  const std::string& name = run.robot.joints()[joint].name;
  std::optional<ImpedanceCut> most;
  const int64_t end = interval.end.value_or(run.num_ticks);
  for (const auto& [tick, bridge] : Messages(run.bridge, interval.begin, end)) {
    if ((bridge->saturated[joint] & bridge_status_t::LIMIT_IMPEDANCE) == 0) continue;
    const std::optional<ImpedanceCut> cut = CutAt(run, tick, joint);
    if (cut && (!most || cut->share > most->share)) most = cut;
  }
  if (!most) {
    return fmt::format("{}: stiffness, damping, position or velocity cut to what the robot bears",
                       name);
  }
  return fmt::format("{}: {}", name, most->Text());
}

/// "left_ankle_pitch: 12.7 to 7.5 N·m, of 14.1 N·m wanted", over the interval.
std::string LimitedText(const RunRecord& run, size_t joint, const MotorLimit& limit,
                        const Interval& interval) {
  const std::string& name = run.robot.joints()[joint].name;
  if (limit.bit == bridge_status_t::LIMIT_IMPEDANCE) return CutText(run, joint, interval);
  const auto applied = OfTick(
      run.bridge, [&](const bridge_status_t& bridge) { return bridge.applied_torque[joint]; });
  double from = applied(interval.begin - 1).value_or(*applied(interval.begin)), to = from;
  Answer wanted;
  const int64_t end = interval.end.value_or(run.num_ticks);
  for (const auto& [tick, bridge] : Messages(run.bridge, interval.begin, end)) {
    if ((bridge->saturated[joint] & limit.bit) == 0) continue;
    const double now = bridge->applied_torque[joint];
    // A cold motor is held at its largest torque, a hot one to ever less.
    const bool more = limit.bit == bridge_status_t::LIMIT_TORQUE
                          ? std::abs(now) >= std::abs(to) || tick == interval.begin
                          : std::abs(now) <= std::abs(to) || tick == interval.begin;
    if (more) to = now;
    const Answer want = WantedTorque(run, tick, joint);
    if (want && (!wanted || std::abs(*want) > std::abs(*wanted))) wanted = want;
  }
  return fmt::format("{}: {:.1f} to {:.1f} N·m{}", name, Tenths(from), Tenths(to),
                     wanted ? fmt::format(", of {:.1f} N·m wanted", Tenths(*wanted)) : "");
}

/// " (stiffness of left_knee_pitch: -5 N·m/rad)", of what a drive cannot close, in the last command
/// before a cycle.
std::string NegativeGain(const RunRecord& run, int64_t tick) {
  constexpr int64_t kLast = 100;  // ticks
  for (int64_t t = tick; t >= std::max<int64_t>(0, tick - kLast); --t) {
    const joint_command_t* const command = run.command.at(t);
    if (command == nullptr) continue;
    for (size_t joint = 0; joint < command->stiffness.size(); ++joint) {
      for (const bool stiff : {true, false}) {
        const double gain = stiff ? command->stiffness[joint] : command->damping[joint];
        if (!(gain < 0)) continue;
        return fmt::format(" ({} of {}: {:.4g} {})", stiff ? "stiffness" : "damping",
                           run.robot.joints()[joint].name, gain, stiff ? "N·m/rad" : "N·m·s/rad");
      }
    }
  }
  return "";
}

}  // namespace

void AddMotorEvents(const RunRecord& run, EventList* events) {
  const size_t joints = run.robot.joints().size();
  const auto gap = static_cast<int64_t>(std::ceil(kLimitGap / run.spec.tick_period()));
  std::map<std::pair<size_t, size_t>, std::vector<Interval>> limited;  // by limit and joint
  for (const auto& [tick, bridge] : Messages(run.bridge, 0, run.num_ticks)) {
    if (bridge->state != bridge_status_t::STATE_RUNNING) continue;
    for (size_t joint = 0; joint < joints; ++joint) {
      if (bridge->saturated[joint] == 0) continue;
      for (size_t i = 0; i < std::size(kMotorLimits); ++i) {
        const int bit = kMotorLimits[i].bit;
        if ((bridge->saturated[joint] & bit) == 0) continue;
        if (bit == bridge_status_t::LIMIT_IMPEDANCE && IsRounding(run, tick, joint)) continue;
        std::vector<Interval>& intervals = limited[{i, joint}];
        if (intervals.empty() || tick - *intervals.back().end > gap)
          intervals.push_back({tick, {}});
        intervals.back().end = tick + 1;
      }
    }
  }
  for (auto& [of, intervals] : limited) {
    const auto [i, joint] = of;
    const MotorLimit& limit = kMotorLimits[i];
    for (Interval& interval : intervals) {
      if (*interval.end == run.num_ticks) interval.end.reset();
      events->Add(interval.begin, limit.begins, LimitedText(run, joint, limit, interval));
      events->AddEndOf(interval, limit.ends, run.robot.joints()[joint].name);
    }
  }
}

void AddBridgeEvents(const RunRecord& run, EventList* events) {
  const ElementNames names(run.robot);
  const bridge_status_t* before = nullptr;
  for (const auto& [tick, bridge] : Messages(run.bridge, 0, run.num_ticks)) {
    if (before != nullptr && bridge->state != before->state) {
      std::string reason = BridgeReasonText(*bridge, names);
      if (bridge->reason == bridge_status_t::REASON_COMMAND_NOT_FINITE) {
        reason += NegativeGain(run, tick);
      }
      events->Add(tick, "bridge_state",
                  fmt::format("{} to {}{}", BridgeStateName(before->state),
                              BridgeStateName(bridge->state), reason.empty() ? "" : ": " + reason));
    }
    before = bridge;
  }
}

}  // namespace poise::logging
