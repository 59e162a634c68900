// The table and the summary at the end of a run.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "logging/events/events.h"
#include "logging/metrics/metrics.h"
#include "logging/run_record.h"
#include "tools/cli/text_table.h"
#include "tools/report/run_outcome.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

/// A row of the table.
struct CheckResult {
  std::string name;  ///< the metric's
  std::string label;
  std::string unit;
  std::string joint;  ///< that `measured` is of; empty: of no single one
  std::optional<double> measured;
  std::optional<double> at_most;
  std::optional<double> at_least;
  std::string paper;
  std::optional<double> paper_value;
  /// What the run lacks to know `measured` ("GROUND_TRUTH.com_position"); empty: it is known, or
  /// what it is of never happened.
  std::vector<std::string> missing;
  bool passed = true;  ///< false: it breaks a limit; what is not known or has no limit breaks none
  bool of_every_run = false;  ///< no check of the scenario's own
  bool limited() const { return at_most || at_least; }
  bool known() const { return missing.empty(); }
};

/// True when no check is broken, and of the scenario's own checks with a limit, if it has any, at
/// least one is known.
bool ChecksPass(const std::vector<CheckResult>& checks);

/// First tick at or after check_from.
int64_t FirstCheckedTick(const Scenario& scenario, const logging::RunRecord& run);

/// The scenario's checks on a run, after those of every run: it reached its planned end, so did
/// its reference, its log is whole, and each component did its work. Throws ConfigError for a check
/// whose metric does not exist.
std::vector<CheckResult> EvaluateChecks(const Scenario& scenario, const logging::RunRecord& run);

/// A line for each figure that is not known: what it needs. `all`: those without a limit, too.
std::string FormatUnknown(const std::vector<CheckResult>& checks, bool all);

/// Columns what, measured, limit, paper, verdict; every row.
std::string FormatTable(const std::vector<CheckResult>& checks);
/// "12.3 mm", "0.1 rad, left_knee_pitch"; "not known", or "none" of what never happened.
std::string FormatMeasured(const CheckResult& check);
/// "≤ 45 mm", "0.35 … 0.6 s"; empty without a limit.
std::string FormatLimit(const CheckResult& check);
/// "ok", "FAILED", "not known", or nothing without a limit.
TableCell VerdictCell(const CheckResult& check);
/// The faults that were injected, and how long control was lost by each; empty when there were
/// none.
std::string FormatFaults(const RunOutcome& outcome);
/// The processes of a run in real time: latencies, deadlines, what the system granted, memory.
std::string FormatProcesses(const RunOutcome& outcome);
/// The scenario's assumptions with the values they have.
std::string FormatAssumptions(const Scenario& scenario);

/// Words for SCHEDULING_* of health_t.
std::vector<std::string> SchedulingNames(int8_t scheduling);

/// null where it is not known.
nlohmann::ordered_json OrNull(const std::optional<double>& value);

/// Parts of summary.json: the components' latencies and counters, checks, events.
nlohmann::ordered_json ComponentsJson(const std::map<std::string, health_t>& components);
nlohmann::ordered_json ChecksJson(const std::vector<CheckResult>& checks);
nlohmann::ordered_json EventsJson(const std::vector<logging::Event>& events);

/// What summary.json says of the run itself, without how it was run and how it ended.
nlohmann::ordered_json RunJson(const Scenario& scenario, const logging::RunRecord& run,
                               const std::vector<CheckResult>& checks);

/// Ticks of the scenario in which the bridge did not follow a command, of a run in real time.
struct LostTicks {
  int64_t ticks = 0;
  /// Ticks of these that had no command in time, while the controller gave none that was wrong: the
  /// machine was late, or a fault was injected.
  int64_t late = 0;
  /// The drives are processes of this machine: only its lateness or an injected fault loses frames.
  bool emulated = false;
};

/// What a run came to.
struct RunSummary {
  std::string mode;  ///< "processes" or "inline"
  RunOutcome outcome;
  std::optional<RunOutcome> reference;  ///< of the reference variant's run
  std::vector<CheckResult> checks;
  std::vector<logging::Event> events;
  bool passed = false;
  LostTicks lost;
  bool failed_by_machine = false;  ///< see FailedByMachine
};

/// The checks of a summary.json. Throws std::exception when it is none.
std::vector<CheckResult> ChecksOf(const nlohmann::json& summary);

std::string SummaryJson(const Scenario& scenario, const logging::RunRecord& run,
                        const RunSummary& summary);

}  // namespace poise
