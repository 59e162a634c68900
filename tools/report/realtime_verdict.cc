#include "tools/report/realtime_verdict.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "components/framework/runners/timing.h"
#include "fmt/format.h"

namespace poise {
namespace {

constexpr char kFollowMetric[] = "bridge_not_running_ticks";
constexpr char kFramesMetric[] = "bus_frames_lost";

bool WantOfCommand(int8_t reason) {
  return reason == bridge_status_t::REASON_NO_COMMAND ||
         reason == bridge_status_t::REASON_COMMAND_STALE ||
         reason == bridge_status_t::REASON_CYCLE_OVERRUN;
}

std::string Grouped(int64_t number) {
  std::string text = std::to_string(number);
  for (int i = static_cast<int>(text.size()) - 3; i > 0; i -= 3) {
    text.insert(static_cast<size_t>(i), 1, ',');
  }
  return text;
}

std::string MachineLine(const MachineVerdict& machine) {
  if (!machine.known) return "machine: not known, its report is missing\n";
  std::string text =
      fmt::format("machine: {} of {} cycles late", Grouped(machine.late), Grouped(machine.cycles));
  if (machine.latest > 0) text += fmt::format(", worst {:.1f} ms", machine.latest * 1e3);
  const MachineLoad& load = machine.load;
  text += fmt::format("\n  {:.1f} processes (at most {}) wanted one of its {} CPUs, load {:.1f}",
                      load.runnable, load.runnable_max, load.cpus, load.load);
  if (load.pressure)
    text += fmt::format(",\n  one had to wait in {:.0f} % of the time", 100 * *load.pressure);
  return text + "\n";
}

}  // namespace

MachineVerdict JudgeMachine(const RunSpec& spec, const RunOutcome& outcome) {
  MachineVerdict verdict;
  if (!spec.realtime() || !outcome.machine) return verdict;
  verdict.load = *outcome.machine;
  for (int i = 0; i < static_cast<int>(outcome.processes.size()); ++i) {
    const health_t& health = outcome.processes[static_cast<size_t>(i)].health;
    if (TimingOf(spec, i) != Timing::kOwner) {
      verdict.skipped = std::max(verdict.skipped, health.ticks_skipped);
      continue;
    }
    verdict.known = health.ticks_completed > 0;
    // A cycle that never began is late, too.
    verdict.cycles = health.ticks_completed + health.ticks_skipped;
    verdict.late = health.deadline_misses + health.ticks_skipped;
    const double overlong = health.latency_max * 1e-6 - spec.tick_period();
    verdict.latest = std::max({0.0, health.lateness_max * 1e-6, overlong});
  }
  return verdict;
}

LostTicks CountLostTicks(const logging::RunRecord& run) {
  LostTicks lost;
  if (!run.spec.realtime()) return lost;
  lost.emulated = std::ranges::any_of(run.spec.graph().component(), &ComponentInstance::plant);
  bool wrong = false;
  for (int64_t tick = run.first_tick; tick < run.num_ticks; ++tick) {
    const joint_command_t* command = run.command.at(tick);
    wrong =
        wrong || (command != nullptr && command->status == joint_command_t::STATUS_INVALID_INPUT);
    const bridge_status_t* bridge = run.bridge.at(tick);
    if (bridge == nullptr || bridge->state == bridge_status_t::STATE_RUNNING) continue;
    ++lost.ticks;
    lost.late += WantOfCommand(bridge->reason) ? 1 : 0;
  }
  if (wrong) lost.late = 0;
  return lost;
}

bool FailedByMachine(const std::vector<CheckResult>& checks, const LostTicks& lost) {
  const auto failed = [](const CheckResult& check) { return !check.passed; };
  const auto by_machine = [&](const CheckResult& check) {
    return check.passed || (check.name == kFollowMetric && lost.ticks > 0) ||
           (check.name == kFramesMetric && lost.emulated);
  };
  return std::ranges::any_of(checks, failed) && std::ranges::all_of(checks, by_machine) &&
         lost.late == lost.ticks;
}

std::string CauseOfLateness(const RunOutcome& outcome) {
  const auto killed = std::ranges::count_if(outcome.faults, &InjectedFault::killed);
  const auto died = outcome.takeovers - killed;
  std::string cause;
  if (!outcome.faults.empty())
    cause = fmt::format("{} faults were injected, ", outcome.faults.size());
  if (died > 0) cause += fmt::format("{} processes died or were killed, and replaced, ", died);
  return cause.empty() ? "the machine was late" : cause + "or the machine was late";
}

std::string FormatRealtime(const RunSpec& spec, const RunOutcome& outcome,
                           const std::vector<CheckResult>& checks, const LostTicks& lost) {
  if (!spec.realtime() || outcome.processes.empty()) return "";
  std::string text;
  if (outcome.crane_let_go) {
    text += fmt::format("crane: let go at {:.3f} s\n", *outcome.crane_let_go);
  }
  text += MachineLine(JudgeMachine(spec, outcome));
  const auto limited = [](const CheckResult& check) { return check.limited() && check.known(); };
  const auto holds = [&](const CheckResult& check) { return limited(check) && check.passed; };
  const auto number = std::ranges::count_if(checks, limited);
  const auto good = std::ranges::count_if(checks, holds);
  if (number == 0) {
    return text + fmt::format("controller: {}\n",
                              outcome.completed ? "the run reached its end" : outcome.message);
  }
  text += fmt::format("controller: {} of {} checks hold\n", good, number);
  if (lost.ticks > 0 && lost.late == lost.ticks) {
    text += fmt::format(
        "  the bridge did not follow in {} ticks for want of a command in time, not for a wrong "
        "one:\n  {}\n",
        lost.ticks, CauseOfLateness(outcome));
  }
  return text;
}

nlohmann::ordered_json RealtimeJson(const RunSpec& spec, const RunOutcome& outcome,
                                    const LostTicks& lost) {
  const MachineVerdict machine = JudgeMachine(spec, outcome);
  if (!machine.known) return nullptr;
  const MachineLoad& load = machine.load;
  return {{"cycles", machine.cycles},
          {"late_cycles", machine.late},
          {"latest", machine.latest},
          {"skipped_ticks", machine.skipped},
          {"cpus", load.cpus},
          {"load", load.load},
          {"runnable", load.runnable},
          {"runnable_max", load.runnable_max},
          {"cpu_pressure", OrNull(load.pressure)},
          {"crane_let_go", OrNull(outcome.crane_let_go)},
          {"ticks_not_followed", lost.ticks},
          {"for_want_of_a_command_in_time", lost.late}};
}

}  // namespace poise
