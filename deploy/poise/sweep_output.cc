#include "deploy/poise/sweep_output.h"

#include <cstdio>

#include "deploy/poise/run_dir.h"
#include "deploy/poise/sweep_maps.h"
#include "deploy/poise/sweep_table.h"
#include "fmt/format.h"
#include "logging/printable.h"

namespace poise {
namespace {

constexpr char kTableFile[] = "table.csv";
constexpr char kLimitsFile[] = "limits.csv";
constexpr char kMapsFile[] = "maps.html";
constexpr int kShownProblems = 10;

}  // namespace

void WriteOutput(const std::filesystem::path& folder, const SweepHeader& header,
                 const SweepRows& rows) {
  WriteFile(folder / kTableFile, SweepCsv(header, rows));
  if (header.sweep.has_limit()) WriteFile(folder / kLimitsFile, LimitCsv(header, rows));
  WriteFile(folder / kMapsFile, MapsPage(header, rows));
}

void PrintOutput(const std::filesystem::path& folder, const SweepHeader& header,
                 const SweepRows& rows) {
  fmt::print("{}", FormatOutcomes(rows));
  if (header.sweep.has_limit()) fmt::print("\n{}", FormatLimits(header, rows));
  fmt::print("\n{}\n", (folder / kTableFile).string());
  if (header.sweep.has_limit()) fmt::print("{}\n", (folder / kLimitsFile).string());
  fmt::print("{}\n", (folder / kMapsFile).string());
}

bool AllRan(const SweepRows& rows) {
  int problems = 0;
  for (const auto& [key, row] : rows) {
    if (row.outcome != kInvalid && row.outcome != kCrashed) continue;
    if (++problems > kShownProblems) continue;
    fmt::print(stderr, "poise: run {}{}: {}: {}\n", row.run,
               row.limit ? fmt::format(" at {}", *row.limit) : "", row.outcome,
               logging::LinesForTerminal(row.reason));
  }
  if (problems > kShownProblems) {
    fmt::print(stderr, "poise: and {} more\n", problems - kShownProblems);
  }
  return problems == 0;
}

}  // namespace poise
