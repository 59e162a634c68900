#include <google/protobuf/text_format.h>

#include <cstdio>
#include <memory>

#include "components/framework/run.h"
#include "deploy/poise/cli_checks.h"
#include "deploy/poise/commands.h"
#include "deploy/poise/inline_run.h"
#include "deploy/poise/launcher.h"
#include "deploy/poise/report.h"
#include "deploy/poise/run_dir.h"
#include "deploy/poise/run_setup.h"
#include "deploy/poise/signals.h"
#include "fmt/format.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct RunOptions {
  std::string scenario = "push_double_support";
  std::string out;
  RunChanges changes;
  bool in_process = false;
  bool quiet = false;
};

RunOutcome RunGraph(const RunOptions& options, const LoadedScenario& loaded, const fs::path& dir,
                    const RunSpec& spec) {
  std::string text;
  google::protobuf::TextFormat::PrintToString(spec, &text);
  const LaunchFiles files{fs::read_symlink("/proc/self/exe").parent_path().string(), dir.string(),
                          (dir / "run_spec.pbtxt").string(), (dir / "scenario.pbtxt").string()};
  WriteFile(files.spec_file, text);
  WriteFile(files.scenario_file, ScenarioText(loaded.scenario));
  CatchStopSignals();
  Progress progress(static_cast<double>(spec.num_ticks()) * spec.tick_period(), options.quiet);
  if (options.in_process) {
    return RunInline(spec, ScenarioText(loaded.scenario), dir / "run.lcm", &progress);
  }
  return Launcher(spec, files, &progress).Run();
}

int Run(const RunOptions& options) {
  const LoadedScenario loaded = LoadScenario(options.scenario, options.changes);
  std::vector<std::string> warnings;
  RunSpec spec = MakeRunSpec(loaded, options.changes, &warnings);
  spec.set_recorded(!options.in_process);
  for (const std::string& warning : warnings) fmt::print(stderr, "warning: {}\n", warning);
  CheckRun(loaded, &spec);
  if (!options.in_process) ChoosePorts(&spec);
  const fs::path dir = MakeRunDir(options.out, spec.scenario());
  if (!options.quiet) {
    fmt::print("{}: {}\n", spec.scenario(), loaded.scenario.description());
    fmt::print("{} s at {} Hz, {}; seed {}; run {}{}\n", loaded.scenario.duration(),
               loaded.scenario.tick_rate(),
               options.in_process
                   ? "in one process"
                   : fmt::format("{} processes and the recorder", spec.graph().component_size()),
               spec.seed(), spec.run_id(),
               options.in_process ? "" : fmt::format("; listen at {}", MirrorUrl(spec)));
    std::fflush(stdout);
  }

  const RunOutcome outcome = RunGraph(options, loaded, dir, spec);
  if (!outcome.message.empty()) {
    fmt::print(stderr, "poise: {}: {}\n", outcome.completed ? "run ended" : "run failed",
               outcome.message);
    for (const std::string& line : outcome.details) fmt::print(stderr, "  {}\n", line);
  }
  const fs::path log = dir / "run.lcm";
  if (!fs::exists(log)) return kExitFailed;  // the recorder never came to start
  logging::RunRecord record = logging::ReadRun(log);
  if (outcome.wall_time > 0) {
    record.real_time_factor = record.time(record.num_ticks) / outcome.wall_time;
  }
  record.first_tick = FirstCheckedTick(loaded.scenario, record);
  const std::vector<CheckResult> checks = EvaluateChecks(loaded.scenario, record);
  bool passed = outcome.completed;
  for (const CheckResult& check : checks) passed = passed && check.passed;
  WriteFile(dir / "summary.json",
            SummaryJson(loaded.scenario, record, outcome,
                        options.in_process ? "inline" : "processes", checks, passed));
  if (!options.quiet) {
    fmt::print("\n{}\n{}", FormatTable(checks), FormatAssumptions(loaded.scenario));
    fmt::print("\n{:.3f} s simulated in {:.2f} s, {:.1f} x real time; {}\n",
               record.time(record.num_ticks), outcome.wall_time,
               record.real_time_factor.value_or(0), dir.string());
  }
  fmt::print("{}\n", passed ? "passed" : "FAILED");
  return passed ? kExitOk : kExitFailed;
}

}  // namespace

void AddRunCommand(CLI::App* app, Command* command) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* run = app->add_subcommand("run", "run a scenario and check it");
  run->add_option("scenario", options->scenario, "name (poise list scenarios) or .pbtxt file")
      ->capture_default_str();
  run->add_option("--out", options->out, "folder of the run; default: a dated one under runs/");
  CLI::Option* in_process = run->add_flag("--inline", options->in_process,
                                          "the same graph inside one process, without the network");
  run->add_flag("--realtime", options->changes.realtime, "pace the ticks with the wall clock");
  run->add_option("--set", options->changes.set,
                  "change a field of the scenario, e.g. --set sim_ode.push[0].peak=120")
      ->type_name("FIELD=VALUE")
      ->allow_extra_args(false)
      ->take_all();
  run->add_option("--duration", options->changes.duration, "simulated time, s")
      ->check(Within("in (0, 36000]", [](double s) { return s > 0 && s <= 36000; }));
  run->add_option("--seed", options->changes.seed, "of all noise")
      ->check([](const std::string& text) -> std::string {
        const bool digits = text.find_first_not_of("0123456789") == std::string::npos;
        return digits ? "" : fmt::format("{}: must be a whole number, 0 or more", text);
      });
  run->add_option("--drop", options->changes.drop_rate,
                  "share of the messages that each process drops, to test the recovery")
      ->check(Within("in [0, 0.9]", [](double share) { return share >= 0 && share <= 0.9; }))
      ->excludes(in_process);
  run->add_flag("--quiet", options->quiet, "only errors and the verdict");
  run->callback([options, command] { *command = [options] { return Run(*options); }; });
}

}  // namespace poise
