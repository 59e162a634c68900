#include "tools/benchmark/benchmark_folder.h"

#include <gnu/libc-version.h>

#include <nlohmann/json.hpp>
#include <set>

#include "components/framework/build_info.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/modules.h"
#include "fmt/format.h"
#include "tools/charts/sweep_charts.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/output_style.h"
#include "tools/report/html_report.h"
#include "tools/scenario/library_versions.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// Name and hash, without the folder, which is this machine's.
ordered_json FileJson(const fs::path& file) {
  return {{"file", file.filename().string()}, {"sha1", Sha1(ReadFile(file.string()))}};
}

/// Users' modules and programs, any of which may be the controller.
ordered_json ModulesJson() {
  ordered_json modules = ordered_json::array();
  for (const fs::path& folder : PoisePath()) {
    for (const char* place : {"lib/poise/modules", "lib/poise/components", "lib/poise/bin"}) {
      if (folder == InstalledPrefix()) continue;  // Poise's own, which the program's digest has
      std::set<fs::path> files;
      std::error_code error;
      for (const auto& entry : fs::directory_iterator(folder / place, error)) {
        if (entry.is_regular_file()) files.insert(entry.path());
      }
      for (const fs::path& file : files) modules.push_back(FileJson(file));
    }
  }
  return modules;
}

ordered_json SubjectJson(const BenchmarkSet& set) {
  const BenchmarkSubject& subject = set.subject();
  const BenchmarkRobot& robot = set.robot();
  ordered_json json = {{"robot",
                        {{"name", robot.name},
                         {"text", FileJson(robot.file)},
                         {"maker's", FileJson(robot.maker_file)},
                         {"mass", robot.mass},
                         {"com_height", robot.height}}},
                       {"engine", set.engine()}};
  ordered_json controller = {{"graph", {{"sha1", Sha1(set.graph_text())}}}};
  if (!subject.controller.empty()) controller["file"] = subject.controller;
  if (!subject.changes.variant.empty()) controller["variant"] = subject.changes.variant;
  if (!subject.changes.drives.empty()) controller["drives"] = subject.changes.drives;
  controller["set"] = subject.changes.set;
  controller["without"] = subject.changes.without;
  controller["modules"] = ModulesJson();
  json["controller"] = controller;
  return json;
}

ordered_json FigureJson(const BenchmarkFigure& figure) {
  ordered_json json = {{"point", figure.point}};
  if (figure.untold != nullptr) {
    json["outcome"] = figure.untold->outcome;
    json["component"] = figure.untold->component;
    json["stage"] = figure.untold->stage;
    json["reason"] = figure.untold->reason;
    return json;
  }
  json["value"] = OrNull(figure.value);
  json["unit"] = figure.unit;
  json["bound"] = figure.bound;
  json["impulse"] = OrNull(figure.impulse);
  json["impulse_per_mass"] = OrNull(figure.per_mass);
  json["share_of_lip"] = OrNull(figure.of_pendulum);
  json["share_of_lip_of_duration"] = OrNull(figure.of_duration);
  return json;
}

ordered_json PartJson(const BenchmarkResult& result) {
  const Sweep& sweep = result.header.sweep;
  ordered_json json = {{"name", result.part.name()},
                       {"definition", result.header.digest},
                       {"runs", result.rows.size()}};
  json["scenario_seed"] = result.part.scenario().seed();
  if (sweep.has_random()) json["sweep_seed"] = sweep.seed();
  std::string rows;
  for (const auto& [key, row] : result.rows) rows += SweepRow::RowText(row) + "\n";
  json["rows_sha1"] = Sha1(rows);
  ordered_json figures = ordered_json::array(), untold = ordered_json::array();
  for (const BenchmarkFigure& figure : BenchmarkFigures(result)) {
    (figure.untold != nullptr ? untold : figures).push_back(FigureJson(figure));
  }
  json["figures"] = figures;
  json["untold"] = untold;
  return json;
}

/// What `poise run` is to be told in the benchmark's folder, beside the sweep's own changes.
std::string RunOf(const BenchmarkSet& set, const BenchmarkPart& part) {
  return fmt::format("set/{}_scenario.pbtxt --robot {}", part.name(),
                     ShellWord(set.subject().changes.robot));
}

}  // namespace

fs::path SetFolder(const fs::path& folder) { return folder / "set"; }

fs::path PartFolder(const fs::path& folder, const BenchmarkPart& part) {
  return folder / "parts" / part.name();
}

std::string WriteBenchmark(const fs::path& folder, const BenchmarkSet& set,
                           const std::vector<BenchmarkResult>& results, bool quick,
                           const std::string& command) {
  const std::string csv = BenchmarkCsv(results);
  const std::string sha1 = Sha1(csv);
  WriteFile(folder / kBenchmarkCsv, csv);
  ordered_json json = {
      {"benchmark", {{"name", set.benchmark().name()}, {"sha1", Sha1(set.text())}}},
      {"points", quick ? "quick" : "all"},
      {"command", command},
      {"poise",
       {{"version", PoiseVersion()},
        {"commit", PoiseCommit()},
        {"instruction_set", InstructionSet()}}},
      {"libraries", LibraryVersions()},
      {"glibc", gnu_get_libc_version()}};
  json.update(SubjectJson(set));
  for (const BenchmarkResult& result : results) json["parts"].push_back(PartJson(result));
  json["table_sha1"] = sha1;
  WriteFile(folder / kBenchmarkJson, json.dump(1) + "\n");

  ordered_json charts = {{"format", kChartsFormat},
                         {"title", fmt::format("{}: {}", set.benchmark().name(), set.robot().name)},
                         {"description", set.benchmark().description()},
                         {"text", WithoutTones(FormatBenchmark(results))},
                         {"parts", ordered_json::array()}};
  for (const BenchmarkResult& result : results) {
    charts["parts"].push_back(SweepChartsPart(result.header, result.rows, RunOf(set, result.part)));
    charts["parts"].back()["name"] = result.part.name();
    charts["parts"].back()["title"] = result.part.title();
  }
  WriteCharts(folder, charts);
  return sha1;
}

}  // namespace poise
