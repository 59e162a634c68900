// What the terminal shows of a run that has ended.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"
#include "logging/events/events.h"
#include "logging/run_record.h"
#include "tools/report/report.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

/// A run to be shown. The references outlive it.
struct ShownRun {
  const Scenario& scenario;
  const logging::RunRecord& record;
  const std::vector<CheckResult>& checks;
  const std::vector<logging::Event>& events;
  std::string end;  ///< why it ended, where its starter knows more than the log
};

/// Two sentences, and the rows that the paper has a figure for (of a scenario without such: its own
/// checks), each with its limit.
std::string FormatScreen(const ShownRun& run);

/// FormatScreen with every row, the events and the assumptions.
std::string FormatFullScreen(const ShownRun& run);

/// The physics engine of the run's simulated robot with all that it alone is told, the step and the
/// ground's friction; empty: nothing is simulated.
std::string FormatEngine(const Scenario& scenario, const Graph& graph);

/// "passed: 12 of 12 checks hold, 3 not known", or "FAILED: 1 of 22: NAME measured X, limit Y", one
/// line.
/// `problem`: what else made the run fail; empty when nothing did.
std::string FormatVerdict(const std::vector<CheckResult>& checks, const std::string& problem);

/// FormatVerdict for a person, in colour: lines of their own name what failed, and what is not
/// known for want of what; then how many of the checks the short table above shows.
std::string FormatVerdictLines(const Scenario& scenario, const std::vector<CheckResult>& checks,
                               const std::string& problem, bool below_full_table);

/// Where to look next, for a run in `dir`, of which `checks` were made; `latest`: the commands find
/// it without a name. `matrix`: what `poise matrix` takes to repeat this very run; empty: nothing.
std::string FormatNext(const Scenario& scenario, const std::vector<CheckResult>& checks,
                       const std::filesystem::path& dir, bool latest, const std::string& matrix);

/// The address of a file, for a browser: "file:///home/me/report.html".
std::string FileAddress(const std::filesystem::path& file);

}  // namespace poise
