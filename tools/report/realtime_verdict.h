// What a run in real time owes to the machine, and what to the controller.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"
#include "logging/run_record.h"
#include "tools/report/report.h"
#include "tools/report/run_outcome.h"

namespace poise {

/// The clock's owner and what the machine let it do, over the whole run, its lead included.
struct MachineVerdict {
  bool known = false;  ///< false: not in real time, or nobody reported
  int64_t cycles = 0;
  int64_t late = 0;     ///< that ended after the next was to begin, or never began
  double latest = 0;    ///< s, after its time, of the latest begin or end
  int64_t skipped = 0;  ///< ticks that a component was too late to work on, the worst component's
  MachineLoad load;
};

MachineVerdict JudgeMachine(const RunSpec& spec, const RunOutcome& outcome);

LostTicks CountLostTicks(const logging::RunRecord& run);

/// True when checks failed, and only those that a late machine fails by itself: the bridge did not
/// follow for want of a command, or emulated drives lost frames.
bool FailedByMachine(const std::vector<CheckResult>& checks, const LostTicks& lost);

/// What may have kept commands from coming in time: what was injected, processes that died or were
/// killed by somebody, or the machine.
std::string CauseOfLateness(const RunOutcome& outcome);

/// Lines "crane:", "machine:" and "controller:" of a run in real time; empty of another.
/// `checks`: none without a log.
std::string FormatRealtime(const RunSpec& spec, const RunOutcome& outcome,
                           const std::vector<CheckResult>& checks, const LostTicks& lost);

/// FormatRealtime for summary.json; null of a run that was not in real time.
nlohmann::ordered_json RealtimeJson(const RunSpec& spec, const RunOutcome& outcome,
                                    const LostTicks& lost);

}  // namespace poise
