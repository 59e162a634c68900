#include "tools/maps/sweep_output.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <system_error>
#include <thread>
#include <vector>

#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/child_process.h"
#include "tools/cli/output_place.h"
#include "tools/maps/sweep_charts.h"
#include "tools/maps/sweep_edge.h"
#include "tools/maps/sweep_maps.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

constexpr char kTableFile[] = "table.csv";
constexpr char kLimitsFile[] = "limits.csv";
constexpr char kMapsFile[] = "maps.html";
constexpr char kConverter[] = "rsvg-convert";
constexpr char kPngZoom[] = "2";  // pixels for one of the SVG's: sharp in print
constexpr int kShownProblems = 10;

namespace fs = std::filesystem;

/// Path of a program of PATH; empty when there is none.
fs::path FindProgram(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path file = fs::path(folder) / name;
    std::error_code error;
    if (fs::is_regular_file(file, error)) return file;
  }
  return {};
}

/// Throws std::system_error; false: it failed, and `log` says why.
bool ConvertToPng(const fs::path& converter, const fs::path& svg, const fs::path& log) {
  const fs::path png = fs::path(svg).replace_extension(".png");
  ChildProcess child(
      kConverter, {converter.string(), "--zoom", kPngZoom, "--output", png.string(), svg.string()},
      log.string());
  while (!child.ended()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return child.succeeded();
}

void WriteMaps(const fs::path& folder, const std::vector<std::string>& charts) {
  const fs::path converter = FindProgram(kConverter);
  const fs::path log = folder / "rsvg-convert.log";
  std::string problem;
  if (converter.empty()) {
    problem =
        fmt::format("{} is not installed; on Debian: librsvg2-bin, or deploy/setup", kConverter);
  }
  for (size_t i = 0; i < charts.size(); ++i) {
    const fs::path svg = folder / fmt::format("map_{}.svg", i + 1);
    WriteFile(svg, StandaloneSvg(charts[i]));
    if (!problem.empty()) continue;
    try {
      if (!ConvertToPng(converter, svg, log)) problem = "see " + log.string();
    } catch (const std::system_error& error) {
      problem = error.what();
    }
  }
  if (!problem.empty()) {
    fmt::print(stderr, "poise: the maps are not all there as PNG: {}\n", problem);
  } else {
    std::error_code error;
    fs::remove(log, error);  // empty
  }
}

}  // namespace

void WriteOutput(const std::filesystem::path& folder, const SweepHeader& header,
                 const SweepRows& rows) {
  WriteFile(folder / kTableFile, SweepCsv(header, rows));
  if (header.sweep.has_limit()) WriteFile(folder / kLimitsFile, LimitCsv(header, rows));
  const SweepMaps maps = MapCharts(header, rows);
  WriteFile(folder / kMapsFile, MapsPage(header, rows, maps));
  WriteMaps(folder, maps.all());
}

void PrintOutput(const std::filesystem::path& folder, const SweepHeader& header,
                 const SweepRows& rows) {
  for (const std::string& sentence : SurvivalSentences(header, rows)) fmt::print("{}\n", sentence);
  fmt::print("\n{}", FormatOutcomes(header, rows));
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
