#include "tools/charts/sweep_output.h"

#include <cstdio>

#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/charts/sweep_charts.h"
#include "tools/charts/sweep_edge.h"
#include "tools/cli/output_place.h"
#include "tools/report/html_report.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

constexpr char kTableFile[] = "table.csv";
constexpr char kLimitsFile[] = "limits.csv";
constexpr int kShownProblems = 10;

}  // namespace

bool AllRan(const SweepRows& rows) {
  int problems = 0;
  for (const auto& [key, row] : rows) {
    if (row.survived()) continue;
    if (++problems > kShownProblems) continue;
    fmt::print(stderr, "poise: run {}{}: {}\n", row.run,
               row.limit ? fmt::format(" at {}", *row.limit) : "",
               logging::LinesForTerminal(row.Ending()));
  }
  if (problems > kShownProblems) {
    fmt::print(stderr, "poise: and {} more\n", problems - kShownProblems);
  }
  return problems == 0;
}

void WriteSweepFiles(const std::filesystem::path& folder, const SweepHeader& header,
                     const SweepRows& rows) {
  WriteFile(folder / kTableFile, SweepCsv(header, rows));
  if (header.sweep.has_limit()) WriteFile(folder / kLimitsFile, LimitCsv(header, rows));
  WriteCharts(folder, SweepCharts(header, rows, folder));
}

bool Deliver(const std::filesystem::path& folder, const SweepHeader& header,
             const SweepRows& rows) {
  WriteSweepFiles(folder, header, rows);
  for (const std::string& sentence : SurvivalSentences(header, rows)) fmt::print("{}\n", sentence);
  fmt::print("\n{}", FormatOutcomes(header, rows));
  if (header.sweep.has_limit()) fmt::print("\n{}", FormatLimits(header, rows));
  fmt::print("\n{}\n", (folder / kTableFile).string());
  if (header.sweep.has_limit()) fmt::print("{}\n", (folder / kLimitsFile).string());
  fmt::print("{}\n", (folder / kChartsPage).string());
  std::fflush(stdout);
  return AllRan(rows);
}

}  // namespace poise
