// `poise sweep`: many runs of a scenario with varied fields.
#include <memory>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/charts/sweep_output.h"
#include "tools/cli/output_place.h"
#include "tools/commands/commands.h"
#include "tools/run/run_dir.h"
#include "tools/sweep/sweep_session.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct MergeOptions {
  std::vector<std::string> folders;
  std::string out;
  bool force = false;
  bool partial = false;
};

int RunSweep(const SweepOptions& given) {
  const SessionOptions& options = given.session;
  const SweepDefinition definition(given.arguments, /*limit=*/false);
  const auto [first, end] = SelectedRuns(options, definition.points().size());
  SweepSession session(definition, kKindSweep, options);
  const int64_t before = CountDone(first, end, session.rows());
  fmt::print("{}: {} runs{}{}, {} at a time; {}\n", definition.name(), end - first,
             end - first < definition.points().size()
                 ? fmt::format(" of {}", definition.points().size())
                 : "",
             before > 0 ? fmt::format(", {} done before", before) : "", options.jobs,
             session.folder().string());
  if (!RunPoints(PointRange(first, end), &session)) {
    fmt::print(stderr, "poise: interrupted; {} of {} runs are done; --resume --out {} goes on\n",
               CountDone(first, end, session.rows()), end - first, session.folder().string());
    return kExitFailed;
  }
  return Deliver(session.folder(), session.header(), session.rows()) ? kExitOk : kExitFailed;
}

/// Throws ConfigError when points are missing or not searched to the end.
void CheckComplete(const SweepHeader& header, const SweepRows& rows) {
  const int64_t size = SweepPoints(header.sweep).size();
  int64_t done = 0;
  if (header.kind == kKindLimit) {
    for (const LimitPoint& point : LimitPoints(header, rows)) done += point.search.Wanted().empty();
  } else {
    done = static_cast<int64_t>(rows.size());
  }
  if (done == size) return;
  std::vector<bool> seen(static_cast<size_t>(size));
  for (const auto& [key, row] : rows) seen[static_cast<size_t>(row.run)] = true;
  const auto missing = std::find(seen.begin(), seen.end(), false);
  const std::string which = missing == seen.end() ? "some are not searched to their end"
                                                  : fmt::format("point {} is the first that lacks",
                                                                missing - seen.begin());
  throw ConfigError(
      fmt::format("{} of {} points are there, {}; give their folders too, or "
                  "--partial",
                  done, size, which));
}

int Merge(const MergeOptions& options) {
  std::optional<SweepResults> merged;
  std::string first;
  for (const std::string& folder : options.folders) {
    const std::string source = (fs::path(folder) / kResultsFile).string();
    const std::optional<SweepResults> results = ReadResults(folder);
    if (!results) throw ConfigError(fmt::format("{}: there are no results", source));
    if (!merged) {
      merged.emplace();
      merged->header = results->header;
      first = source;
    } else if (const std::string problem = HeaderProblem(merged->header, results->header);
               !problem.empty()) {
      throw ConfigError(fmt::format("{}: beside {}, {}", source, first, problem));
    }
    for (const auto& [key, row] : results->rows) AddRow(row, source, &merged->rows);
  }
  if (!options.partial) CheckComplete(merged->header, merged->rows);
  const fs::path out = MakeOutFolder(options.out);
  const RunDir dir(out);
  CheckFolderFree("--out", options.out, options.force);
  {
    SweepResultsWriter writer(out, merged->header, {});
    for (const auto& [key, row] : merged->rows) writer.Append(row);
  }
  return Deliver(out, merged->header, merged->rows) ? kExitOk : kExitFailed;
}

}  // namespace

void AddSweepCommand(CLI::App* app, Command* command) {
  auto options = std::make_shared<SweepOptions>();
  CLI::App* sweep =
      app->add_subcommand("sweep", "run a scenario over a grid of values, or over random ones");
  AddSweepOptions(sweep, options.get());
  sweep->footer(
      "OUT holds results.jsonl (a finished run a line, on the disk before the next begins), "
      "table.csv (a row a run, the same bytes whether resumed, split or in parallel), charts.json "
      "(docs/reference/charts.md) and charts.html, which draws it; poise report OUT OTHER lays two "
      "of them over each other. A sweep's file: tools/sweep/sweep.proto; "
      "docs/reference/sweeps.md.\nExit code: 0 when every run was made, fallen or not; 1 when "
      "interrupted or a run could not be made; 2 wrong usage or configuration.\nExample: poise "
      "sweep push_double_support --vary 'sim.push[0].peak=100:250:7'");
  const auto [merge, merge_options] = AddCommand<MergeOptions>(
      sweep, command, "merge", "one table from the folders of a sweep's, or a limit's, parts",
      Merge);
  sweep->require_subcommand(0, 1);
  merge->add_option("folder", merge_options->folders, "folders with results")->required();
  merge->add_option("--out", merge_options->out, "folder for the whole")->required();
  merge->add_flag("--force", merge_options->force, "replace what --out holds");
  merge->add_flag("--partial", merge_options->partial, "though points are missing");
  merge->footer(
      "The whole has what one sweep has.\nExit code: 0 when every run was made, fallen or not; 1 "
      "when one could not be made; 2 wrong usage or configuration.\nExample: poise sweep merge "
      "runs/first runs/second --out runs/whole");
  // It is called after its command's callback.
  sweep->callback([options, command, merge = merge] {
    if (!merge->parsed()) *command = [options] { return RunSweep(*options); };
  });
}

}  // namespace poise
