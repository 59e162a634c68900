#include "tools/maps/sweep_output.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <sstream>
#include <system_error>
#include <thread>
#include <vector>

#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/child_process.h"
#include "tools/cli/output_place.h"
#include "tools/cli/signals.h"
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

/// The maps of the page as files of their own. Pictures are drawn by processes beside this one.
class MapFiles {
 public:
  /// Writes the maps as SVG and begins with the first `pictures` of them. Throws ConfigError.
  MapFiles(const fs::path& folder, const std::vector<std::string>& charts, size_t pictures)
      : folder_(folder), charts_(charts.size()), pictures_(pictures) {
    for (size_t i = 0; i < charts.size(); ++i) WriteFile(Svg(i), StandaloneSvg(charts[i]));
    if (pictures_ > 0 && converter_.empty()) {
      problem_ =
          fmt::format("{} is not installed; on Debian: librsvg2-bin, or deploy/setup", kConverter);
    }
    Draw();
  }

  /// Waits for the pictures and prints what there is; on stderr why one is missing.
  void Finish() {
    while ((next_ < pictures_ && problem_.empty()) || !drawing_.empty()) {
      if (StopSignal() != 0) {
        problem_ = "interrupted";
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      for (auto child = drawing_.begin(); child != drawing_.end();) {
        child = (*child)->ended() && End(**child) ? drawing_.erase(child) : std::next(child);
      }
      Draw();
    }
    drawing_.clear();
    if (charts_ > 0) {
      fmt::print("{}: {} map{}, {} as .png\n", (folder_ / "map_1.svg").string(), charts_,
                 charts_ == 1 ? "" : "s", drawn_);
    }
    if (!problem_.empty()) {
      fmt::print(stderr, "poise: the maps are not all there as PNG: {}\n", problem_);
    }
  }

 private:
  fs::path Svg(size_t i) const { return folder_ / fmt::format("map_{}.svg", i + 1); }
  /// Begins with pictures, as many at a time as there are cores.
  void Draw() {
    const size_t at_once = std::max(1u, std::thread::hardware_concurrency());
    while (next_ < pictures_ && problem_.empty() && drawing_.size() < at_once) {
      const fs::path svg = Svg(next_++);
      const std::vector<std::string> command = {converter_.string(),
                                                "--zoom",
                                                kPngZoom,
                                                "--output",
                                                fs::path(svg).replace_extension(".png").string(),
                                                svg.string()};
      const std::string log = fs::path(svg).replace_extension(".log").string();
      try {
        drawing_.push_back(std::make_unique<ChildProcess>(kConverter, command, log));
      } catch (const std::system_error& error) {
        problem_ = error.what();
      }
    }
  }
  /// True.
  bool End(const ChildProcess& child) {
    if (child.succeeded()) {
      ++drawn_;
      std::error_code error;
      fs::remove(child.log_path(), error);  // empty
    } else {
      problem_ = "see " + child.log_path();
    }
    return true;
  }

  fs::path folder_;
  size_t charts_, pictures_;
  size_t next_ = 0, drawn_ = 0;
  const fs::path converter_ = FindProgram(kConverter);
  std::vector<std::unique_ptr<ChildProcess>> drawing_;
  std::string problem_;
};

/// The tables and the page; false: there is no map, and so no page.
bool WriteFiles(const fs::path& folder, const SweepHeader& header, const SweepRows& rows,
                const SweepMaps& maps) {
  WriteFile(folder / kTableFile, SweepCsv(header, rows));
  if (header.sweep.has_limit()) WriteFile(folder / kLimitsFile, LimitCsv(header, rows));
  const fs::path page = folder / kMapsFile;
  if (maps.all().empty()) {
    std::error_code error;
    fs::remove(page, error);  // of what --force replaces
    return false;
  }
  WriteFile(page, MapsPage(header, rows, maps));
  return true;
}

void PrintOutput(const fs::path& folder, const SweepHeader& header, const SweepRows& rows,
                 bool page) {
  for (const std::string& sentence : SurvivalSentences(header, rows)) fmt::print("{}\n", sentence);
  fmt::print("\n{}", FormatOutcomes(header, rows));
  if (header.sweep.has_limit()) fmt::print("\n{}", FormatLimits(header, rows));
  fmt::print("\n{}\n", (folder / kTableFile).string());
  if (header.sweep.has_limit()) fmt::print("{}\n", (folder / kLimitsFile).string());
  if (page) fmt::print("{}\n", (folder / kMapsFile).string());
  std::fflush(stdout);
}

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

void WriteSweepFiles(const fs::path& folder, const SweepHeader& header, const SweepRows& rows) {
  WriteFiles(folder, header, rows, MapCharts(header, rows));
}

bool Deliver(const fs::path& folder, const SweepHeader& header, const SweepRows& rows,
             bool all_pictures) {
  const SweepMaps maps = MapCharts(header, rows);
  const bool page = WriteFiles(folder, header, rows, maps);
  const std::vector<std::string> charts = maps.all();
  // A curve of each metric, which nobody asked for, is drawn as SVG alone: a converter's start is
  // most of its time.
  const bool all = all_pictures || header.sweep.map_size() > 0;
  MapFiles files(folder, charts, all ? charts.size() : maps.survival.size());
  PrintOutput(folder, header, rows, page);
  files.Finish();
  return AllRan(rows);
}

}  // namespace poise
