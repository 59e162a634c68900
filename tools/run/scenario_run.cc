#include "tools/run/scenario_run.h"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <thread>
#include <utility>

#include "components/framework/build_info.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "logging/run_log_writer.h"
#include "tools/cli/child_process.h"
#include "tools/cli/progress.h"
#include "tools/cli/signals.h"
#include "tools/report/html_report.h"
#include "tools/report/realtime_verdict.h"
#include "tools/report/run_screen.h"
#include "tools/run/inline_run.h"
#include "tools/run/launcher.h"
#include "tools/run/run_dir.h"
#include "tools/run/run_registry.h"
#include "tools/scenario/described_components.h"
#include "tools/scenario/former_fields.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr char kRos2Log[] = "ros2.log";
constexpr std::chrono::seconds kRos2End{5};  // that it may take to tell the run's last messages
constexpr std::chrono::milliseconds kRos2Look{10};

/// "7 processes", or "3 processes (controller: state_estimator, step_planner)".
std::string ProcessesText(const Graph& graph) {
  const std::vector<std::string> processes = ProcessNames(graph);
  std::string shared;
  for (const std::string& process : processes) {
    std::vector<std::string> names;
    for (const int i : ComponentsOf(graph, process)) names.push_back(graph.component(i).name());
    if (names.size() < 2) continue;
    shared += fmt::format("{}{}: {}", shared.empty() ? "" : "; ", process, fmt::join(names, ", "));
  }
  return fmt::format("{} processes{}", processes.size(),
                     shared.empty() ? "" : fmt::format(" ({})", shared));
}

void PrintOutcome(const std::string& what, const RunOutcome& outcome) {
  if (!outcome.warning.empty()) fmt::print(stderr, "warning: {}\n", outcome.warning);
  if (outcome.message.empty()) return;
  fmt::print(stderr, "poise: {} {}: {}\n", what, outcome.completed ? "ended" : "failed",
             outcome.message);
  for (const std::string& line : outcome.details) fmt::print(stderr, "  {}\n", line);
}

std::vector<std::string> Ros2Command(const fs::path& dir) {
  return {fs::read_symlink("/proc/self/exe").string(), "ros2", dir.string()};
}

/// Lets it tell the run's last messages. What became of it changes nothing about the run.
void EndRos2(ChildProcess* ros2) {
  const bool early = ros2->ended();
  if (!early) ros2->Signal(SIGINT);
  const auto deadline = std::chrono::steady_clock::now() + kRos2End;
  while (!ros2->ended() && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(kRos2Look);
  }
  if (!early && ros2->ended() && ros2->succeeded()) return;
  const std::vector<std::string> last = LastLines(ros2->log_path(), 1);
  fmt::print(stderr, "warning: poise ros2 {}{}{}\n",
             ros2->ended() ? ros2->HowItEnded() : "did not end in time", last.empty() ? "" : ": ",
             last.empty() ? "" : logging::ForTerminal(last.front()));
}

}  // namespace

ScenarioRun::ScenarioRun(const std::string& scenario, const RunOptions& options)
    : ScenarioRun(scenario, SetUpRun(scenario, options.changes), options) {}

ScenarioRun::ScenarioRun(const std::string& scenario, RunSetup setup, const RunOptions& options)
    : scenario_(scenario),
      options_(options),
      main_(Prepare(std::move(setup), options.in_process, true)) {
  if (options.launch.kills.count > 0) KillSchedule::Check(main_.spec, options.launch.kills);
  if (!main_.loaded.scenario.has_reference()) return;
  reference_ = Prepare(SetUpRun(scenario, ReferenceChanges(main_.loaded, options.changes)),
                       /*in_process=*/true, false);
}

RunSetup ScenarioRun::Prepare(RunSetup setup, bool in_process, bool warn) const {
  setup.spec.set_recorded(!in_process && options_.launch.log);
  // Each process makes its own components, and so does an interactive run, as often as it goes
  // back.
  if (!in_process || (warn && options_.interactive)) setup.graph.reset();
  if (warn) {
    for (const std::string& text : setup.warnings) fmt::print(stderr, "warning: {}\n", text);
  }
  const std::string program = in_process ? OwnProgramOf(setup.spec.graph()) : "";
  if (!program.empty()) {
    throw ConfigError(fmt::format(
        "{}, which a run inside one process cannot hold; {}", program,
        warn ? "poise run without --inline and --interactive makes each component a process"
             : "the reference variant is run so: leave it out with --no-reference"));
  }
  return setup;
}

RunOutcome ScenarioRun::RunPart(RunSetup* setup, const run_info_t& info, const fs::path& dir,
                                const RunSocket* socket, bool quiet, const LaunchOptions& launch,
                                std::optional<logging::RunRecord>* record) {
  const RunSpec& spec = setup->spec;
  Progress progress(static_cast<double>(spec.num_ticks() - spec.lead_ticks()) * spec.tick_period(),
                    quiet, static_cast<double>(spec.lead_ticks()) * spec.tick_period());
  if (socket == nullptr) {
    BoundGraph graph = *std::exchange(setup->graph, std::nullopt);
    return RunInline(spec, std::move(graph), info, dir / "run.lcm", &progress, record);
  }
  return Launcher(spec, *socket, dir, launch, &progress).Run();
}

void ScenarioRun::PrintHeading() const {
  const Scenario& scenario = main_.loaded.scenario;
  const RunSpec& spec = main_.spec;
  const Variant* const chosen = main_.loaded.variant();
  const std::string variant = chosen != nullptr ? fmt::format(", variant {}", chosen->name()) : "";
  const std::string paper =
      scenario.has_paper_section()
          ? fmt::format(" ({}the paper's {})", ChangedByHand(scenario) ? "changed from " : "",
                        scenario.paper_section())
          : "";
  std::string text = fmt::format(
      "{}{}{}: {}\n", Toned(spec.scenario(), Tone::kStrong), variant, paper,
      chosen != nullptr && chosen->has_description()
          ? fmt::format("{} (a variant of: {})", chosen->description(), scenario.description())
          : scenario.description());
  text += FormatChanges(scenario);
  if (reference_) {
    text += fmt::format("compared with variant {}, which runs first, in one process\n",
                        scenario.reference());
  }
  text += fmt::format(
      "{} s at {} Hz, {}; seed {}; poise {}{}\n", scenario.duration(), scenario.tick_rate(),
      options_.in_process ? "in one process"
                          : fmt::format("{}{}", ProcessesText(spec.graph()),
                                        options_.launch.log ? " and the recorder" : ", no log"),
      spec.seed(), PoiseVersion(),
      *PoiseCommit() == '\0' ? "" : fmt::format(" ({})", PoiseCommit()));
  const std::string engine = FormatEngine(scenario, spec.graph());
  if (!engine.empty()) text += engine + "\n";
  if (!options_.in_process) {
    text += fmt::format("run {}; listen at {}\n", spec.run_id(), MirrorUrl(spec));
  }
  fmt::print("{}", Wrapped(text, ScreenStyle().columns, 2));
  std::fflush(stdout);
}

void ScenarioRun::PrintEnd(const logging::RunRecord& record, const RunResult& result,
                           bool latest) const {
  const RunSummary& summary = result.summary;
  const RunOutcome& outcome = summary.outcome;
  const std::string realtime = FormatRealtime(main_.spec, outcome, summary.checks, summary.lost);
  std::string problem;
  if (!outcome.completed) {
    problem = outcome.message.empty() ? "the run did not reach its end" : outcome.message;
  } else if (summary.reference && !summary.reference->completed) {
    problem = fmt::format("the reference run: {}", summary.reference->message);
  } else if (!summary.passed && summary.checks.empty()) {
    problem = "there is no log";
  }
  const char* const by =
      summary.failed_by_machine ? ", for want of commands or frames in time alone" : "";
  if (options_.quiet || summary.checks.empty()) {
    if (!options_.quiet) fmt::print("{}", realtime);
    fmt::print("{}{}\n", FormatVerdict(summary.checks, problem), by);
    return;
  }
  // Whoever stops a run does not ask for its figures.
  if (outcome.interrupted) {
    fmt::print("{}\nIts log up to {:.3f} s: {}\n", FormatVerdict({}, problem),
               record.time(record.num_ticks), (result.dir / "run.lcm").string());
    return;
  }
  const ShownRun shown{main_.loaded.scenario, record, summary.checks, summary.events,
                       outcome.message};
  fmt::print("\n{}\n{}{}", options_.full ? FormatFullScreen(shown) : FormatScreen(shown),
             Wrapped(realtime, ScreenStyle().columns, 2),
             FormatVerdictLines(main_.loaded.scenario, summary.checks, problem, options_.full));
  if (*by != '\0') {
    fmt::print("It failed for want of commands in time alone: {}.\n", CauseOfLateness(outcome));
  }
  fmt::print("{:.3f} s simulated in {:.2f} s, {:.1f} x real time\n",
             record.duration(record.num_ticks), outcome.wall_time,
             record.real_time_factor.value_or(0));
  // A matrix knows none of these changes: beside it this run would be another one.
  const std::string matrix = options_.changes == RunChanges{} ? scenario_ : "";
  fmt::print("{}", FormatNext(main_.loaded.scenario, summary.checks, result.dir, latest, matrix));
}

LogSizes ScenarioRun::log_sizes() const {
  LogSizes sizes;
  if (options_.in_process || options_.launch.log) sizes.Add(ExpectedLogSize(main_.spec));
  if (reference_) sizes.Add(ExpectedLogSize(reference_->spec));
  return sizes;
}

RunResult ScenarioRun::Run(const std::string& out, bool latest) {
  const Scenario& scenario = main_.loaded.scenario;
  std::optional<RunSource> source;
  if (!options_.in_process) source.emplace(ChoosePorts(main_.loaded.scenario, &main_.spec));
  RunResult result;
  const std::string space =
      CheckSpace(out.empty() ? RunsDir() : fs::path(out), log_sizes(), options_.force);
  const RunDir dir = MakeRunDir(out, name(), options_.force);
  result.dir = dir.path();
  // Also what runs after its reference can be found and watched from here on.
  run_info_t info = logging::MakeRunInfo(main_.spec, ScenarioText(scenario));
  WriteRunFiles(result.dir, info);
  if (latest) PointLatestTo(result.dir);
  const RunRegistration registration(result.dir);
  if (!options_.quiet) PrintHeading();
  if (!options_.quiet && !space.empty()) {
    fmt::print("{}\n", Wrapped(space, ScreenStyle().columns, 2));
    std::fflush(stdout);
  }
  CatchStopSignals();
  RunSummary& summary = result.summary;
  summary.mode = options_.in_process ? "inline" : "processes";
  if (reference_) {
    const RunDir reference = MakeRunDir(ReferenceDir(result.dir).string(), name(), true);
    const run_info_t its =
        logging::MakeRunInfo(reference_->spec, ScenarioText(reference_->loaded.scenario));
    WriteRunFiles(reference.path(), its);
    summary.reference =
        RunPart(&*reference_, its, reference.path(), /*socket=*/nullptr, /*quiet=*/true, {});
    PrintOutcome(fmt::format("reference run (variant {})", scenario.reference()),
                 *summary.reference);
  }
  std::optional<logging::RunRecord> kept;  // of what ran in this process
  if (StopSignal() == 0) {
    std::optional<ChildProcess> ros2;
    if (options_.ros2) ros2.emplace("ros2", Ros2Command(result.dir), result.dir / kRos2Log);
    info.started_at = logging::TimeNow();  // the reference has run meanwhile
    summary.outcome = options_.interactive
                          ? options_.interactive(main_.spec, scenario, info, result.dir / "run.lcm")
                          : RunPart(&main_, info, result.dir, source ? &source->socket() : nullptr,
                                    options_.quiet, options_.launch, &kept);
    if (ros2) EndRos2(&*ros2);
    PrintOutcome("run", summary.outcome);
    for (const std::string& warning : summary.outcome.warnings) {
      fmt::print(stderr, "warning: {}\n", logging::ForTerminal(warning));
    }
    if (!summary.outcome.strangers.empty()) {
      fmt::print(stderr, "warning: refused {}\n",
                 logging::LinesForTerminal(summary.outcome.strangers));
    }
    if (!options_.quiet && !summary.outcome.interrupted) {
      fmt::print("{}", FormatFaults(summary.outcome));
      if (main_.spec.realtime()) fmt::print("{}", FormatProcesses(summary.outcome));
    }
  } else {
    summary.outcome = *summary.reference;  // interrupted
  }
  const RunOutcome& outcome = summary.outcome;
  const fs::path log = result.dir / "run.lcm";
  const bool recorded = fs::exists(log);  // else the recorder never came to start
  logging::RunRecord record;
  if (recorded) {
    StageLine line(options_.quiet);
    if (!kept) line.Begin("reading the log");
    record = kept ? std::move(*kept) : logging::ReadRun(log);
    line.Begin("figures of the table");
    PrepareRecord(log, scenario, &record);
    if (outcome.wall_time > 0) {
      record.real_time_factor = record.duration(record.num_ticks) / outcome.wall_time;
    }
    summary.checks = EvaluateChecks(scenario, record);
    summary.events = logging::Events(record);
    summary.lost = CountLostTicks(record);
  } else {
    record.spec = main_.spec;
  }
  summary.passed = (recorded || !options_.launch.log) && outcome.completed &&
                   (!summary.reference || summary.reference->completed) &&
                   ChecksPass(summary.checks);
  summary.failed_by_machine =
      !summary.passed && outcome.completed && FailedByMachine(summary.checks, summary.lost);
  // What is known is said first: a full disk takes the summary along with the log.
  std::string unwritten;
  try {
    WriteFile(result.dir / "summary.json", SummaryJson(scenario, record, summary));
  } catch (const ConfigError& error) {
    unwritten = error.what();
    summary.passed = false;
  }
  PrintEnd(record, result, latest);
  if (!unwritten.empty()) fmt::print(stderr, "poise: {}\n", unwritten);
  std::fflush(stdout);
  return result;
}

RunOutcome ScenarioRun::RunOnly(const std::string& out) {
  std::optional<RunSource> source;
  if (!options_.in_process) source.emplace(ChoosePorts(main_.loaded.scenario, &main_.spec));
  const RunDir dir = MakeRunDir(out, name(), options_.force);
  const run_info_t info = logging::MakeRunInfo(main_.spec, ScenarioText(scenario()));
  WriteRunFiles(dir.path(), info);
  CatchStopSignals();
  return RunPart(&main_, info, dir.path(), source ? &source->socket() : nullptr, /*quiet=*/true,
                 options_.launch);
}

void PrepareRecord(const fs::path& log, const Scenario& scenario, logging::RunRecord* record) {
  record->first_tick = FirstCheckedTick(scenario, *record);
  const fs::path reference = ReferenceDir(log.parent_path()) / "run.lcm";
  if (scenario.has_reference() && fs::exists(reference)) {
    record->reference = std::make_shared<logging::RunRecord>(logging::ReadRun(reference));
    record->reference->first_tick = FirstCheckedTick(scenario, *record->reference);
  }
}

ReportedRun ReadReportedRun(const std::string& run, StageLine* line) {
  ReportedRun result;
  result.log = FindLog(run).string();
  WarnOfRunInfo(result.log);
  line->Begin("reading the log");
  result.record = logging::ReadRun(result.log);
  line->End();
  if (result.record.info.scenario.empty()) {
    throw logging::LogError(
        fmt::format("{}: RUN_INFO is damaged and scenario.pbtxt is not beside it: put the "
                    "scenario's text there",
                    result.log));
  }
  result.scenario = LoggedScenario(result.record.info.scenario, result.log + ": RUN_INFO.scenario");
  line->Begin("figures of the table");
  PrepareRecord(result.log, result.scenario, &result.record);
  if (result.scenario.has_reference() && result.record.reference == nullptr) {
    line->End();
    fmt::print(stderr, "warning: {}: is missing; what compares with it has no value\n",
               (ReferenceDir(fs::path(result.log).parent_path()) / "run.lcm").string());
  }
  line->Begin("figures of the table");
  result.checks = EvaluateChecks(result.scenario, result.record);
  line->End();
  return result;
}

}  // namespace poise
