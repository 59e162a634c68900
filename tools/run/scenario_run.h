// One scenario run from its name to its summary.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "components/framework/graph.pb.h"
#include "poise/run_info_t.hpp"
#include "tools/cli/output_place.h"
#include "tools/report/report.h"
#include "tools/run/launcher.h"
#include "tools/scenario/run_setup.h"

namespace poise {

class StageLine;
struct ReportedRun;

struct RunOptions {
  RunChanges changes;
  bool in_process = false;
  bool quiet = false;  ///< only the verdict
  bool full = false;   ///< every figure, events, assumptions, processes
  bool force = false;  ///< replace what the folder holds; start where the log may not fit
  LaunchOptions launch;
  bool ros2 = false;  ///< `poise ros2` listens to the run of processes, and ends with it
  /// Runs in this process in place of RunInline and writes the log named, for a caller that lets a
  /// page control it; empty: RunInline does.
  std::function<RunOutcome(const RunSpec& spec, const Scenario& scenario, const run_info_t& info,
                           const std::string& log)>
      interactive;
};

/// What `poise report` and the overview of several runs say of a run's scenario.
struct RunResult {
  RunSummary summary;
  std::filesystem::path dir;
  std::string problem;  ///< why nothing could be run or read; empty: it could
};

/// A checked scenario, ready to run once, with its reference variant.
class ScenarioRun {
 public:
  /// Throws ConfigError or RobotError; what is odd about the robot goes to stderr.
  ScenarioRun(const std::string& scenario, const RunOptions& options);
  /// Takes `setup`, which was made with options.changes.
  ScenarioRun(const std::string& scenario, RunSetup setup, const RunOptions& options);

  /// Runs, writes the run's files into a folder (MakeRunDir's rules for `out`) and prints what
  /// happens, the table and the verdict. With `latest`, runs/latest points there before the run
  /// starts. Throws ConfigError for the folder, LogError for the log.
  RunResult Run(const std::string& out, bool latest);

  /// Runs without a word, without its reference and without checks: the log and what describes it
  /// go into `out`. Throws as Run does.
  RunOutcome RunOnly(const std::string& out);

  const RunSpec& spec() const { return main_.spec; }
  const std::string& name() const { return main_.spec.scenario(); }
  const Scenario& scenario() const { return main_.loaded.scenario; }
  /// What its log and its reference's will take.
  LogSizes log_sizes() const;

 private:
  RunSetup Prepare(RunSetup setup, bool in_process, bool warn) const;
  /// `dir` has the run's files, and so `info`. Inside this process without a `socket`: by the
  /// setup's components, once.
  static RunOutcome RunPart(RunSetup* setup, const run_info_t& info,
                            const std::filesystem::path& dir, const RunSocket* socket, bool quiet,
                            const LaunchOptions& launch,
                            std::optional<logging::RunRecord>* record = nullptr);
  void PrintHeading() const;
  /// What happened, the table, the verdict, where to look next.
  void PrintEnd(const logging::RunRecord& record, const RunResult& result, bool latest) const;

  const std::string scenario_;  // as it was named
  RunOptions options_;
  RunSetup main_;
  std::optional<RunSetup> reference_;
};

/// Makes a record, read from `log`, ready for the scenario's checks: its first_tick, and its
/// reference if the scenario has one and its log is there. Throws LogError or RobotError.
void PrepareRecord(const std::filesystem::path& log, const Scenario& scenario,
                   logging::RunRecord* record);

/// What a report shows of `run` (FindLog), read and checked; `line` says what goes on. Throws as
/// PrepareRecord.
ReportedRun ReadReportedRun(const std::string& run, StageLine* line);

}  // namespace poise
