#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/signals.h"
#include "tools/commands/commands.h"
#include "tools/report/wrench_difference.h"
#include "tools/run/run_dir.h"
#include "tools/run/scenario_run.h"
#include "tools/run/several_runs.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"
#include "tools/sweep/sweep_agreement.h"
#include "tools/sweep/sweep_session.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct WorldsArguments {
  std::vector<std::string> scenarios = {kAllScenarios};
  std::string out;
  RunOptions options;
  SessionOptions session;  ///< of sweeps: jobs, range
};

/// A scenario in one engine.
struct WorldRun {
  std::string engine;
  RunResult result;
  bool stands() const { return result.problem.empty() && result.summary.outcome.completed; }
};

std::vector<std::string> Engines() {
  std::vector<std::string> engines = EngineNames();
  // The paper's experiments were fitted in ODE: what it gives stands first.
  std::stable_partition(engines.begin(), engines.end(),
                        [](const std::string& engine) { return engine == "ode"; });
  return engines;
}

std::string OutcomeText(const WorldRun& world) {
  if (!world.result.problem.empty()) return "could not be run";
  return world.stands() ? "stands" : world.result.summary.outcome.message;
}

/// Engines whose distances from the paper's figure differ by less than this share of it are equal.
constexpr double kEqualShare = 0.01;

/// The engine whose figure is nearest to the paper's; empty without that figure or between equals.
std::string Nearest(const std::vector<WorldRun>& worlds, size_t row) {
  std::vector<std::pair<double, std::string>> distances;
  double paper = 0;
  for (const WorldRun& world : worlds) {
    const CheckResult& check = world.result.summary.checks[row];
    if (!check.measured || !check.paper_value) return "";
    paper = *check.paper_value;
    distances.emplace_back(std::abs(*check.measured - paper), world.engine);
  }
  std::sort(distances.begin(), distances.end());
  if (distances.size() < 2) return "";
  const bool equal = distances[1].first - distances[0].first <= kEqualShare * std::abs(paper);
  return equal ? "" : distances[0].second;
}

/// Each figure over the first engine's; empty where that is none or 0.
std::string Ratio(const CheckResult& first, const CheckResult& other) {
  if (!first.measured || !other.measured || *first.measured == 0) return "";
  return fmt::format("{:.3f}", *other.measured / *first.measured);
}

/// A row for the outcome and each check, a column for each engine.
std::string FormatWorlds(const std::vector<WorldRun>& worlds) {
  std::vector<TableRow> rows = {{"what", "limit", "paper"}, {"outcome", "", ""}};
  for (const WorldRun& world : worlds) {
    rows[0].emplace_back(world.engine);
    rows[1].emplace_back(OutcomeText(world), world.stands() ? Tone::kGood : Tone::kBad);
  }
  rows[0].insert(rows[0].end(), {"ratio", "nearer the paper"});
  rows[1].insert(rows[1].end(), {"", ""});
  const auto ran = [](const WorldRun& world) { return world.result.problem.empty(); };
  if (!std::all_of(worlds.begin(), worlds.end(), ran)) return FormatColumns(rows);
  const std::vector<CheckResult>& first = worlds[0].result.summary.checks;
  for (size_t i = 0; i < first.size(); ++i) {
    if (first[i].of_every_run) continue;
    TableRow row = {first[i].label, FormatLimit(first[i]), first[i].paper};
    for (const WorldRun& world : worlds) {
      const CheckResult& check = world.result.summary.checks[i];
      row.emplace_back(FormatMeasured(check) + (check.passed ? "" : " FAILED"),
                       check.passed ? Tone::kPlain : Tone::kBad);
    }
    row.emplace_back(Ratio(first[i], worlds.back().result.summary.checks[i]));
    row.emplace_back(Nearest(worlds, i));
    rows.push_back(std::move(row));
  }
  return FormatColumns(rows);
}

constexpr char kCsvHead[] =
    "scenario,metric,label,unit,at_least,at_most,paper,engine,measured,passed\n";

std::string WorldsCsv(const std::string& scenario, const std::vector<WorldRun>& worlds) {
  std::string lines;
  for (const WorldRun& world : worlds) {
    for (const CheckResult& check : world.result.summary.checks) {
      lines += fmt::format("{},{},{},{},{},{},{},{},{},{}\n", CsvCell(scenario), check.name,
                           CsvCell(check.label), CsvCell(check.unit), CsvNumber(check.at_least),
                           CsvNumber(check.at_most), CsvNumber(check.paper_value), world.engine,
                           CsvNumber(check.measured), check.passed ? 1 : 0);
    }
  }
  return lines;
}

/// What `engine` is told: no other engine's fields.
RunChanges ChangesFor(const std::string& engine, RunChanges changes) {
  std::erase_if(changes.set, [&](const std::string& change) {
    const std::string of = EngineOfField(change);
    return !of.empty() && of != engine;
  });
  changes.world = engine;
  return changes;
}

WorldRun RunWorld(const std::string& scenario, const std::string& engine, RunOptions options,
                  const fs::path& dir) {
  WorldRun world{engine, {}};
  options.changes = ChangesFor(engine, options.changes);
  fmt::print("{}: ", engine);
  std::fflush(stdout);
  try {
    world.result = ScenarioRun(scenario, options).Run(dir.string(), /*latest=*/false);
  } catch (const std::exception& error) {
    std::fflush(stdout);
    fmt::print(stderr, "poise: {}: {}\n", engine, error.what());
    world.result.problem = error.what();
  }
  return world;
}

constexpr char kWrenchCsvHead[] = "scenario,foot,quantity,unit,rms,largest,time\n";

/// Prints how far the measured wrenches of the first engine's run and the last one's are apart;
/// lines for wrenches.csv. Throws LogError or RobotError.
std::string CompareWrenches(const std::string& scenario, const std::vector<WorldRun>& worlds) {
  const auto read = [](const WorldRun& world) {
    return logging::ReadRun((world.result.dir / "run.lcm").string());
  };
  const std::array<WrenchDifference, 2> feet =
      CompareFootWrenches(read(worlds.front()), read(worlds.back()));
  fmt::print("\n{}", FormatWrenchDifferences(feet));
  std::string lines;
  for (size_t f = 0; f < feet.size(); ++f) {
    const auto add = [&](const char* quantity, const char* unit, const VectorDifference& of) {
      if (of.ticks == 0) return;
      lines += fmt::format("{},{},{},{},{},{},{}\n", CsvCell(scenario), f == 0 ? "right" : "left",
                           quantity, unit, of.rms, of.largest, of.time);
    };
    add("force", "N", feet[f].force);
    add("moment", "N·m", feet[f].moment);
  }
  return lines;
}

/// Throws ConfigError, RobotError.
SweepDefinition DefineSweep(const std::string& sweep, const std::string& engine,
                            const WorldsArguments& arguments) {
  SweepArguments what;
  what.what = sweep;
  what.changes = ChangesFor(engine, arguments.options.changes);
  return SweepDefinition(what, /*limit=*/false);
}

/// Runs a sweep in every engine and prints where they agree. False when a run could not be made or
/// a signal ended it. Throws ConfigError, RobotError.
bool SweepWorlds(const std::string& sweep, const WorldsArguments& arguments,
                 const std::vector<std::string>& engines, const fs::path& folder) {
  std::vector<EngineRows> worlds;
  bool passed = true;
  Sweep swept;
  for (const std::string& engine : engines) {
    const SweepDefinition definition = DefineSweep(sweep, engine, arguments);
    const auto [first, end] = SelectedRuns(arguments.session, definition.points().size());
    SessionOptions session_options = arguments.session;
    session_options.out = (folder / engine).string();
    SweepSession session(definition, kKindSweep, session_options);
    fmt::print("{}: {} runs, {} at a time\n", engine, end - first, session_options.jobs);
    std::fflush(stdout);
    if (!RunPoints(PointRange(first, end), &session)) {
      fmt::print(stderr, "poise: interrupted\n");
      return false;
    }
    WriteFile(session.folder() / "table.csv", SweepCsv(session.header(), session.rows()));
    for (const auto& [key, row] : session.rows()) {
      if (row.survived()) continue;
      if (passed) fmt::print(stderr, "poise: {}: run {}: {}\n", engine, row.run, row.Ending());
      passed = false;
    }
    swept = definition.sweep();
    worlds.push_back({engine, session.rows()});
  }
  fmt::print("\n{}\n", FormatAgreement(swept, worlds.front(), worlds.back()));
  return passed;
}

/// True for the name or file of a sweep; a scenario's name comes first.
bool IsSweep(const std::string& name) {
  if (name == kAllScenarios) return false;
  const fs::path file = FindFileOfKinds({"scenarios", "sweeps"}, name, fs::current_path());
  Sweep sweep;
  try {
    ParseTextProto(ReadFile(file.string()), file.string(), &sweep);
  } catch (const ConfigError&) {
    return false;
  }
  return sweep.has_scenario();
}

int Worlds(WorldsArguments arguments) {
  RunOptions& options = arguments.options;
  options.in_process = true;
  options.quiet = true;
  const std::vector<std::string> engines = Engines();
  std::vector<std::string> given, sweeps;
  for (const std::string& name : arguments.scenarios) {
    (IsSweep(name) ? sweeps : given).push_back(name);
  }
  const std::vector<std::string> scenarios = ExpandScenarios(given);
  std::vector<std::string> names;
  LogSizes sizes;
  for (const std::string& scenario : scenarios) {
    for (const std::string& engine : engines) {
      RunOptions checked = options;
      checked.changes = ChangesFor(engine, checked.changes);
      const ScenarioRun run(scenario, checked);
      if (engine == engines.front()) names.push_back(run.name());
      sizes.Add(run.log_sizes());
    }
  }
  CheckSpace(arguments.out.empty() ? RunsDir() : fs::path(arguments.out), sizes, options.force);
  if (sweeps.empty() && !arguments.session.range.empty()) {
    throw ConfigError("--range: is of a sweep, and none is named");
  }
  // Refused before anything is written.
  for (const std::string& sweep : sweeps) {
    for (const std::string& engine : engines) {
      SelectedRuns(arguments.session, DefineSweep(sweep, engine, arguments).points().size());
    }
  }
  const RunDir folder = MakeRunDir(arguments.out, "worlds", options.force);
  CatchStopSignals();
  bool passed = true;
  std::set<std::string> taken;
  std::string csv = kCsvHead;
  std::string wrenches = kWrenchCsvHead;
  for (size_t i = 0; i < scenarios.size(); ++i) {
    const std::string name = UniqueName(names[i], &taken);
    fmt::print("{}\n", name);
    std::vector<WorldRun> worlds;
    for (const std::string& engine : engines) {
      if (StopSignal() != 0) return kExitFailed;
      worlds.push_back(RunWorld(scenarios[i], engine, options, folder.path() / name / engine));
      passed =
          passed && worlds.back().result.problem.empty() && worlds.back().result.summary.passed;
    }
    fmt::print("\n{}\n", FormatWorlds(worlds));
    csv += WorldsCsv(name, worlds);
    const bool ran = std::ranges::all_of(
        worlds, [](const WorldRun& world) { return world.result.problem.empty(); });
    if (ran) wrenches += CompareWrenches(name, worlds);
  }
  if (!scenarios.empty()) {
    WriteFile(folder.path() / "worlds.csv", csv);
    WriteFile(folder.path() / "wrenches.csv", wrenches);
  }
  for (const std::string& sweep : sweeps) {
    const std::string name = UniqueName(fs::path(sweep).stem().string(), &taken);
    fmt::print("{}\n", name);
    passed = SweepWorlds(sweep, arguments, engines, folder.path() / name) && passed;
    if (StopSignal() != 0) return kExitFailed;
  }
  fmt::print("{}; {}\n", passed ? "all passed" : "FAILED", folder.path().string());
  return passed ? kExitOk : kExitFailed;
}

}  // namespace

void AddWorldsCommand(CLI::App* app, Command* command) {
  const auto [worlds, arguments] = AddCommand<WorldsArguments>(
      app, command, "worlds",
      "run scenarios in every physics engine and compare what comes of them", Worlds);
  RunOptions* const options = &arguments->options;
  worlds->footer(
      "Of a scenario: each check's figure in each engine, the ratio of the last engine's to the "
      "first one's, and how far the measured foot wrenches are apart (worlds.csv, wrenches.csv). "
      "Of a sweep: in how many runs the outcome is the same, and how far the largest values that "
      "stand are apart (table.csv of each engine). A change with --set of an engine's own field "
      "goes to that engine alone.\nExit code 1 when a check failed in an engine or a run of a "
      "sweep could not be made.\nExample: poise worlds push_double_support");
  worlds
      ->add_option("scenario", arguments->scenarios,
                   "names or .pbtxt files of scenarios and sweeps; all: every experiment of the "
                   "paper")
      ->capture_default_str();
  AddChangeOptions(worlds, &options->changes,
                   "change a field of the scenario in every engine (poise list fields)");
  worlds->add_option("--out", arguments->out,
                     "folder for a run's folder each and worlds.csv; default: a dated one under "
                     "runs/");
  AddJobs(worlds, &arguments->session.jobs, "runs of a sweep at a time");
  worlds->add_option("--range", arguments->session.range, "of a sweep, only points A to B - 1")
      ->type_name("A:B");
  worlds->add_flag("--force", options->force,
                   "replace what --out holds; start though the logs may not fit the disk");
}

}  // namespace poise
