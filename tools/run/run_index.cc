#include "tools/run/run_index.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <set>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "fmt/chrono.h"
#include "fmt/format.h"
#include "tools/cli/output_place.h"
#include "tools/cli/text_table.h"
#include "tools/report/matrix_table.h"
#include "tools/run/live_run.h"
#include "tools/run/run_dir.h"
#include "tools/scenario/former_fields.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> FlagsOf(const RunSpec& spec, const fs::path& dir) {
  static const std::set<std::string> kOfOneField = {"--robot", "--world", "--duration", "--seed"};
  const std::string file = (dir / kScenarioFile).string();
  Scenario scenario;
  try {
    scenario = LoggedScenario(ReadFile(file), file);
  } catch (const ConfigError&) {  // another version's: the run is listed all the same
  }
  const Applied& applied = scenario.applied();
  std::vector<std::string> flags(applied.ablation().begin(), applied.ablation().end());
  if (applied.has_variant()) flags.push_back("--variant " + applied.variant());
  if (spec.realtime()) flags.emplace_back("--realtime");
  for (const Applied::Change& change : applied.change()) {
    if (change.by() == "--set") flags.push_back("--set " + change.set());
    if (!kOfOneField.contains(change.by())) continue;
    flags.push_back(change.by() + " " + change.set().substr(change.set().find('=') + 1));
  }
  return flags;
}

int64_t BytesBelow(const fs::path& dir) {
  int64_t bytes = 0;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(dir, error)) {
    const auto size = entry.is_regular_file(error) ? entry.file_size(error) : 0;
    if (!error) bytes += static_cast<int64_t>(size);
  }
  return bytes;
}

/// Throws ConfigError for a folder that no run has made.
PastRun RunOf(const fs::path& dir) {
  const RunSpec spec = ReadRunSpec(dir.string());
  if (!spec.has_run_id()) throw ConfigError(fmt::format("{}: holds no run", dir.string()));
  PastRun run;
  run.dir = dir;
  struct stat status {};
  run.own = lstat(dir.c_str(), &status) == 0 && status.st_uid == geteuid();
  run.robot = RobotNameOf(spec);
  run.scenario = spec.scenario();
  run.flags = FlagsOf(spec, dir);
  run.bytes = BytesBelow(dir);
  MatrixCell cell;
  try {
    ReadCellSummary(dir / "summary.json", &cell);
    run.outcome = fmt::format("{}: {}", cell.passed ? "passed" : "FAILED", cell.outcome);
  } catch (const std::exception&) {
    run.outcome = RunInProgress(dir) ? "goes on" : "not judged";
  }
  run.started_at = cell.started_at;
  // Its start is all that is told of a run without a summary.
  if (run.started_at.empty() && stat((dir / kSpecFile).c_str(), &status) == 0) {
    run.started_at = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(status.st_mtim.tv_sec));
  }
  return run;
}

}  // namespace

std::vector<PastRun> PastRuns() {
  std::vector<PastRun> runs;
  std::error_code error;
  const auto options = fs::directory_options::skip_permission_denied;
  // It follows no link: runs/latest is not another run.
  for (fs::recursive_directory_iterator at(RunsDir(), options, error), end; at != end;
       at.increment(error)) {
    if (!fs::is_regular_file(at->path() / kSpecFile, error) || at->is_symlink(error)) {
      continue;
    }
    at.disable_recursion_pending();  // a reference is part of its run
    try {
      runs.push_back(RunOf(at->path()));
    } catch (const ConfigError&) {  // the file is no run's
    }
  }
  std::ranges::sort(runs, [](const PastRun& a, const PastRun& b) {
    return std::pair(a.started_at, a.dir) > std::pair(b.started_at, b.dir);
  });
  return runs;
}

std::string FormatPastRuns(const std::vector<PastRun>& runs) {
  std::vector<TableRow> rows = {
      {"folder", "started", "robot", "scenario", "outcome", "flags", "size"}};
  for (const PastRun& run : runs) {
    rows.push_back(
        {run.dir.lexically_relative(RunsDir()).string(), run.started_at, run.robot, run.scenario,
         TableCell(run.outcome, run.outcome.starts_with("FAILED") ? Tone::kBad : Tone::kPlain),
         Joined(run.flags, " "), FormatBytes(run.bytes)});
  }
  return FormatColumns(rows);
}

}  // namespace poise
