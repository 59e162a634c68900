// `poise runs`: what to do with the runs that have left a folder.
#include <unistd.h>

#include <cstdio>
#include <ctime>
#include <iostream>
#include <set>

#include "components/framework/configuration/configuration.h"
#include "fmt/chrono.h"
#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_place.h"
#include "tools/commands/commands.h"
#include "tools/run/live_run.h"
#include "tools/run/run_dir.h"
#include "tools/run/run_index.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct PruneOptions {
  size_t keep = 10;
  double days = 0;
  bool yes = false;
};

/// The runs that may go: of each folder in runs/ all or none, so that none is left of half a
/// matrix.
std::vector<PastRun> RunsToPrune(const PruneOptions& options) {
  constexpr double kDay = 24 * 60 * 60;  // s
  const auto oldest = std::time(nullptr) - static_cast<std::time_t>(options.days * kDay);
  const std::string since = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(oldest));
  std::vector<PastRun> old;
  std::set<fs::path> kept;
  for (PastRun& run : PastRuns()) {
    const fs::path folder = *run.dir.lexically_relative(RunsDir()).begin();
    if (kept.contains(folder) || kept.size() < options.keep || run.started_at > since || !run.own ||
        RunInProgress(RunsDir() / folder) || RunInProgress(run.dir)) {
      kept.insert(folder);
    } else {
      old.push_back(std::move(run));
    }
  }
  return old;
}

/// Whether a person says so; false where nobody can be asked.
bool Confirmed() {
  if (isatty(STDIN_FILENO) == 0) {
    fmt::print("nothing is deleted without --yes\n");
    return false;
  }
  fmt::print("delete these? [y/N] ");
  std::fflush(stdout);
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "yes";
}

int Prune(const PruneOptions& options) {
  const std::vector<PastRun> runs = RunsToPrune(options);
  if (runs.empty()) {
    fmt::print("no run in {} is to be deleted\n", logging::ForTerminal(RunsDir().string()));
    return kExitOk;
  }
  fmt::print("{}", FormatPastRuns(runs));
  if (!options.yes && !Confirmed()) return kExitOk;
  int64_t sum = 0;
  for (const PastRun& run : runs) {
    const int64_t freed = RemoveRun(RunDir(run.dir));
    std::error_code error;
    const bool left = fs::exists(run.dir, error);
    // A folder of several runs goes when the last of them has gone.
    if (!left && run.dir.parent_path() != RunsDir()) fs::remove(run.dir.parent_path(), error);
    fmt::print("deleted {}, {}{}\n", logging::ForTerminal(run.dir.string()), FormatBytes(freed),
               left ? "; what no run has written stays" : "");
    sum += freed;
  }
  fmt::print("{} freed\n", FormatBytes(sum));
  return kExitOk;
}

}  // namespace

void AddRunsCommand(CLI::App* app, Command* command) {
  CLI::App* const runs = AddGroup(app, "runs", "what to do with the folders of past runs");
  const auto [prune, options] = AddCommand<PruneOptions>(
      runs, command, "prune", "delete the old runs below runs/, after showing them and asking",
      Prune);
  prune->footer(
      "Only files that runs write are deleted, and folders that are empty then. A folder of "
      "several "
      "runs, such as a matrix, counts as one.\nExample: poise runs prune --keep 20 --days 7");
  prune->add_option("--keep", options->keep, "how many of the newest stay")
      ->check(Whole())
      ->capture_default_str();
  prune->add_option("--days", options->days, "those that began within so many days stay, too")
      ->check(Within("in [0, 36500]", [](double days) { return days >= 0 && days <= 36500; }));
  prune->add_flag("--yes", options->yes, "delete without asking");
}

}  // namespace poise
