#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/command_line.h"
#include "tools/commands/commands.h"
#include "tools/operator/bus_port.h"
#include "tools/run/live_run.h"
#include "tools/run/run_dir.h"
#include "tools/run/run_registry.h"

namespace poise {
namespace {

constexpr std::chrono::milliseconds kStopPause{2};  // between looks at what bridges say
constexpr char kEnded[] =
    "this run has ended, as it does when the robot falls, and a stop ends with it; start one with "
    "poise run";

/// An operator's line to a running bridge.
struct Line {
  std::filesystem::path run;
  std::unique_ptr<BusPort> port;
  std::optional<OperatorAct> answer;

  /// "run 42 (push_double_support, FOLDER)"
  std::string Name() const {
    return fmt::format("run {} ({}, {})", port->spec().run_id(),
                       logging::ForTerminal(port->spec().scenario()),
                       logging::ForTerminal(run.string()));
  }
  /// Nothing holds the lock on the run's folder.
  bool Ended() const {
    std::error_code error;
    return !RunInProgress(std::filesystem::is_directory(run, error) ? run : run.parent_path());
  }
};

/// Throws ConfigError when no bridge can be reached from here, or BusError.
Line LineTo(const std::filesystem::path& run, OperatorAct::Kind kind) {
  Line line{run, std::make_unique<BusPort>(ReadRunSpec(run.string())), {}};
  const std::string why = line.port->WhyNot(kind);
  if (!why.empty()) throw ConfigError(fmt::format("{}: {}", line.Name(), why));
  if (kind != OperatorAct::Kind::kReset) return line;
  try {
    line.port->Join();
  } catch (const BusError&) {
    if (!line.Ended()) throw;
    throw std::runtime_error(fmt::format("{}: {}", line.Name(), kEnded));
  }
  return line;
}

/// Stops all, or resets their stops, and says what became of each; the exit code.
int DoAll(std::vector<Line>& lines, OperatorAct::Kind kind) {
  OperatorAct act;
  act.kind = kind;
  // All runs are told before an answer is awaited: no run waits for another's answer, or for what
  // keeps another from being asked.
  for (Line& line : lines) {
    try {
      line.port->Do(act);
    } catch (const std::exception& error) {
      line.answer = act;
      line.answer->reason = error.what();
    }
  }
  const auto waits = [](const Line& line) { return !line.answer; };
  while (std::ranges::any_of(lines, waits)) {
    for (Line& line : lines) {
      line.port->Update(0);
      for (OperatorAct& answer : line.port->TakeAnswers()) line.answer = std::move(answer);
    }
    std::this_thread::sleep_for(kStopPause);
  }
  int exit_code = kExitOk;
  for (const Line& line : lines) {
    if (line.answer->state == OperatorAct::State::kAccepted) {
      fmt::print("{}: {}\n", line.Name(),
                 kind == OperatorAct::Kind::kStop
                     ? "the bridge has stopped the robot"
                     : "the stop is reset; the bridge follows commands again");
      continue;
    }
    fmt::print(stderr, "poise: {}: {}\n", line.Name(), line.Ended() ? kEnded : line.answer->reason);
    exit_code = kExitFailed;
  }
  return exit_code;
}

/// Lines to every run of this user that goes on. What cannot be reached goes to stderr and lets
/// `exit_code` fail: no run is passed over in silence.
std::vector<Line> AllLines(OperatorAct::Kind kind, int* exit_code) {
  const std::vector<RunningRun> runs = RunningRuns();
  const bool any_own = std::ranges::any_of(runs, [](const RunningRun& run) { return run.own; });
  if (!any_own) OnlyRunningRun("poise log info", "poise estop");  // throws what there is instead
  std::vector<Line> lines;
  for (const RunningRun& run : runs) {
    if (!run.own) {
      fmt::print(stderr, "poise: another user's run goes on too; to stop it: poise estop {}\n",
                 logging::ForTerminal(run.dir.string()));
      continue;
    }
    if (run.readable && !run.networked) {
      fmt::print(stderr,
                 "poise: {}: runs inside one process, without a bridge to stop; end that "
                 "with Ctrl-C\n",
                 logging::ForTerminal(run.dir.string()));
      continue;
    }
    try {
      lines.push_back(LineTo(run.dir, kind));
    } catch (const std::exception& error) {
      fmt::print(stderr, "poise: {}: cannot be reached: {}\n",
                 logging::ForTerminal(run.dir.string()), logging::LinesForTerminal(error.what()));
      *exit_code = kExitFailed;
    }
  }
  if (lines.empty()) *exit_code = kExitFailed;
  return lines;
}

struct EstopOptions {
  std::string run;
  bool reset = false;
};

int Estop(const EstopOptions& options) {
  const auto kind = options.reset ? OperatorAct::Kind::kReset : OperatorAct::Kind::kStop;
  int exit_code = kExitOk;
  std::vector<Line> lines;
  if (options.run.empty()) {
    lines = AllLines(kind, &exit_code);
  } else {
    // It asks for none of several that are called so: a stop must not wait for an answer.
    for (const std::filesystem::path& dir : RunsNamed(options.run)) {
      lines.push_back(LineTo(dir, kind));
    }
  }
  const int done = DoAll(lines, kind);
  return done != kExitOk ? done : exit_code;
}

}  // namespace

void AddEstopCommand(CLI::App* app, Command* command) {
  const auto [estop, options] = AddCommand<EstopOptions>(
      app, command, "estop", "emergency stop of your runs that go on, or of one run (latched)",
      Estop);
  estop->add_option("run", options->run,
                    "folder or name of the run, also another user's; default: every run of yours");
  estop->add_flag("--reset", options->reset,
                  "end a stop: only once the motors are at rest and no torque is commanded");
  SetExample(estop, "poise estop runs/latest");
}

}  // namespace poise
