
#include "fmt/format.h"
#include "logging/log_messages.h"
#include "logging/printable.h"
#include "logging/replay/compare.h"
#include "tools/cli/command_line.h"
#include "tools/commands/commands.h"
#include "tools/run/run_dir.h"

namespace poise {
namespace {

using logging::ForTerminal;

struct ComparedRuns {
  std::string first, second;
};

int CompareRuns(const ComparedRuns& runs) {
  const std::string first_log = FindLog(runs.first).string();
  const std::string second_log = FindLog(runs.second).string();
  WarnOfRunInfo(first_log);
  WarnOfRunInfo(second_log);
  const logging::LogComparison result = logging::CompareLogs(first_log, second_log);
  fmt::print(
      "{} ticks, {} messages compared; {} differ, {} only in the first, {} only in the "
      "second\n",
      result.ticks, result.messages, result.differing, result.only_first, result.only_second);
  if (result.earliest) {
    const logging::LogDifference& d = *result.earliest;
    fmt::print("first: tick {}, {}{}{}: {} and {}\n", d.tick, ForTerminal(d.channel),
               d.field.empty() ? "" : ".",
               ForTerminal(logging::LogMessages(first_log).Label(d.channel, d.field)),
               ForTerminal(d.first), ForTerminal(d.second));
  }
  // Nothing to compare is not equality.
  return result.equal() && result.messages > 0 ? kExitOk : kExitFailed;
}

}  // namespace

void AddCompareCommand(CLI::App* app, Command* command) {
  const auto [compare, runs] = AddCommand<ComparedRuns>(
      app, command, "compare",
      "compare two runs' messages bit for bit (exit code 1 when they differ)", CompareRuns);
  compare->add_option("first", runs->first, "folder of a run or a log")->required();
  compare->add_option("second", runs->second, "folder of a run or a log")->required();
  SetExample(compare, "poise compare runs/before runs/after");
}

}  // namespace poise
