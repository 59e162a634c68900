#include "tools/report/matrix_table.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "fmt/format.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_style.h"
#include "tools/cli/text_table.h"
#include "tools/report/html_report.h"

namespace poise {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kNotJudged[] = "–";

std::string ColumnTitle(const MatrixCell& cell) {
  return cell.variant.empty() ? Spaced(cell.ablation) : "variant " + cell.variant;
}

/// A metric may stand in several checks, with a label each.
bool Same(const CheckResult& a, const CheckResult& b) {
  return a.name == b.name && a.label == b.label;
}

const CheckResult* FindCheck(const MatrixCell& cell, const CheckResult& wanted) {
  for (const CheckResult& check : cell.checks) {
    if (Same(check, wanted)) return &check;
  }
  return nullptr;
}

/// A cell's outcome in its colour, "!" behind it where a check `failed` that nothing else shows.
TableCell Outcome(const MatrixCell& cell, const std::string& outcome, bool failed) {
  if (cell.problem) return {"could not be run", Tone::kBad};
  return {fmt::format("{}{}", outcome, failed ? " !" : ""),
          cell.outcome == "stands" && !failed ? Tone::kGood : Tone::kBad};
}

/// True when the run failed and none of the figures says so.
bool FailedUnseen(const MatrixCell& cell, const std::vector<const CheckResult*>& figures) {
  if (cell.problem || cell.passed) return false;
  bool seen = false;
  for (const CheckResult& check : cell.checks) {
    if (check.passed) continue;
    seen = std::any_of(figures.begin(), figures.end(),
                       [&](const CheckResult* figure) { return Same(*figure, check); });
    if (!seen) return true;
  }
  return !seen;
}

/// Checks that have a figure of the paper, in the order in which the cells have them.
std::vector<const CheckResult*> PaperFigures(const std::vector<const MatrixCell*>& cells) {
  std::vector<const CheckResult*> figures;
  for (const MatrixCell* cell : cells) {
    for (const CheckResult& check : cell->checks) {
      const auto same = [&](const CheckResult* other) { return Same(*other, check); };
      const bool paper = !check.paper.empty() || check.paper_value;
      if (paper && std::none_of(figures.begin(), figures.end(), same)) figures.push_back(&check);
    }
  }
  return figures;
}

/// Whether a run lacks a figure of its scenario: variants may have checks of their own.
bool LacksFigure(const std::vector<const MatrixCell*>& cells) {
  const std::vector<const CheckResult*> figures = PaperFigures(cells);
  return std::ranges::any_of(cells, [&](const MatrixCell* cell) {
    return std::ranges::any_of(
        figures, [&](const CheckResult* figure) { return FindCheck(*cell, *figure) == nullptr; });
  });
}

std::string FormatScenario(const std::vector<const MatrixCell*>& cells) {
  std::vector<TableRow> rows = {{"what", "paper"}, {"outcome", ""}};
  const std::vector<const CheckResult*> figures = PaperFigures(cells);
  for (const MatrixCell* cell : cells) {
    rows[0].emplace_back(ColumnTitle(*cell));
    rows[1].push_back(Outcome(*cell, cell->outcome, FailedUnseen(*cell, figures)));
  }
  for (const CheckResult* figure : figures) {
    std::string paper = figure->paper;
    if (paper.empty()) paper = FormatNumber(*figure->paper_value, figure->unit);
    TableRow row = {figure->label, paper};
    for (const MatrixCell* cell : cells) {
      const CheckResult* const check = FindCheck(*cell, *figure);
      const bool failed = check != nullptr && !check->passed;
      const std::string text =
          check == nullptr ? kNotJudged
                           : fmt::format("{}{}", FormatMeasured(*check), failed ? " !" : "");
      row.emplace_back(text, failed ? Tone::kBad : Tone::kPlain);
    }
    rows.push_back(std::move(row));
  }
  return FormatColumns(rows);
}

/// Index of `name`, which is added where it is not there.
size_t IndexOf(const std::string& name, std::vector<std::string>* names) {
  const auto found = std::find(names->begin(), names->end(), name);
  const auto at = static_cast<size_t>(found - names->begin());
  if (found == names->end()) names->push_back(name);
  return at;
}

/// What each part of the controller is worth: a row for each ablation, a column for each scenario.
std::string FormatOverview(const std::vector<MatrixCell>& cells) {
  std::vector<TableRow> rows(1, TableRow{TableCell("")});
  std::vector<std::string> scenarios;
  std::vector<std::string> ablations;
  for (const MatrixCell& cell : cells) {
    if (!cell.variant.empty()) continue;
    const size_t column = 1 + IndexOf(cell.scenario, &scenarios);
    const size_t row = 1 + IndexOf(cell.ablation, &ablations);
    if (column == rows[0].size()) {
      rows[0].emplace_back(cell.paper_section.empty() ? cell.scenario : cell.paper_section);
    }
    if (row == rows.size()) rows.push_back({ColumnTitle(cell)});
    for (TableRow& each : rows) each.resize(rows[0].size(), "");
    const std::string outcome = cell.fell_at ? fmt::format("fell {:.2f} s", *cell.fell_at)
                                : cell.outcome.starts_with("stopped") ? "stopped"
                                                                      : cell.outcome;
    rows[row][column] = Outcome(cell, outcome, !cell.passed && !cell.fell_at);
  }
  const bool grid = scenarios.size() > 1 && ablations.size() > 1;
  return grid ? FormatColumns(rows) : "";
}

/// A cell's row without its values, at `at`.
Json CellRow(const MatrixCell& cell, size_t run, const std::vector<size_t>& at) {
  std::string told = cell.problem ? "could not be run: " + *cell.problem : cell.outcome;
  for (const CheckResult& check : cell.checks) {
    if (!check.passed) told += "; failed: " + check.label;
  }
  const char* const outcome = cell.problem               ? "invalid"
                              : cell.fell_at             ? "fell"
                              : cell.outcome == "stands" ? "stands"
                                                         : "stopped";
  Json row = {{"run", run}, {"at", at}, {"outcome", outcome}, {"told", told}};
  row["values"] = Json::array();
  row["set"] = cell.command;
  if (!cell.problem) row["log"] = cell.folder;
  return row;
}

/// The ablations and variants of one scenario, over which its figures are drawn.
Json ScenarioPart(const std::vector<const MatrixCell*>& cells) {
  Json choices = Json::array(), values = Json::array(), maps = Json::array(), rows = Json::array();
  for (size_t i = 0; i < cells.size(); ++i) {
    choices.push_back(ColumnTitle(*cells[i]));
    rows.push_back(CellRow(*cells[i], i, {i}));
  }
  for (const CheckResult* const figure : PaperFigures(cells)) {
    maps.push_back({{"x", 0}, {"value", values.size()}});
    values.push_back({{"name", figure->name + " " + figure->label},
                      {"label", figure->label},
                      {"unit", figure->unit}});
    if (figure->paper_value) values.back()["paper"] = *figure->paper_value;
    for (size_t i = 0; i < cells.size(); ++i) {
      const CheckResult* const check = FindCheck(*cells[i], *figure);
      rows[i]["values"].push_back(OrNull(check == nullptr ? std::nullopt : check->measured));
    }
  }
  const MatrixCell& first = *cells.front();
  return {
      {"name", first.scenario},
      {"title",
       first.paper_section.empty() ? first.scenario : first.paper_section + "  " + first.scenario},
      {"kind", "matrix"},
      {"sentences", Json::array({first.description})},
      {"command", ""},
      {"variables", Json::array({{{"name", "controller"}, {"unit", ""}, {"choices", choices}}})},
      {"values", values},
      {"maps", maps},
      {"rows", rows}};
}

/// Cells of a scenario stand together.
std::vector<std::vector<const MatrixCell*>> ByScenario(const std::vector<MatrixCell>& cells) {
  std::vector<std::vector<const MatrixCell*>> groups;
  for (const MatrixCell& cell : cells) {
    if (groups.empty() || groups.back().front()->scenario != cell.scenario) groups.emplace_back();
    groups.back().push_back(&cell);
  }
  return groups;
}

std::string Truth(bool value) { return value ? "true" : "false"; }

}  // namespace

void ReadCellSummary(const std::filesystem::path& file, MatrixCell* cell) {
  std::ifstream in(file);
  const nlohmann::json summary = nlohmann::json::parse(in);
  cell->started_at = summary.at("started_at").get<std::string>();
  cell->passed = summary.at("passed").get<bool>();
  cell->simulated_time = summary.at("simulated_time").get<double>();
  for (const nlohmann::json& event : summary.at("events")) {
    if (event.at("name") == "fall") cell->fell_at = event.at("time").get<double>();
  }
  cell->checks = ChecksOf(summary);
  if (cell->fell_at) {
    cell->outcome = fmt::format("fell at {:.3f} s", *cell->fell_at);
  } else if (summary.at("completed").get<bool>()) {
    cell->outcome = "stands";
  } else {
    cell->outcome = fmt::format("stopped at {:.3f} s: {}", cell->simulated_time,
                                summary.at("end").get<std::string>());
  }
}

std::string FormatMatrix(const std::vector<MatrixCell>& cells) {
  std::string text = FormatOverview(cells);
  if (!text.empty()) text += "\n";
  const bool failed = std::ranges::any_of(
      cells, [](const MatrixCell& cell) { return !cell.problem && !cell.passed; });
  bool lacks = false;
  for (const std::vector<const MatrixCell*>& group : ByScenario(cells)) {
    const MatrixCell& first = *group.front();
    lacks = lacks || LacksFigure(group);
    text += ScreenLines(2, "{}{}{}: {}", first.paper_section,
                        first.paper_section.empty() ? "" : "  ", first.scenario, first.description);
    text += FormatScenario(group) + "\n";
  }
  if (failed) {
    text +=
        ScreenLines(3,
                    "!: outside the limit that the scenario's check sets; at the outcome: a check "
                    "that is not shown failed, see poise report");
  }
  if (lacks) text += fmt::format("{}: not judged, the run has no such check\n", kNotJudged);
  return text;
}

std::string MatrixCsv(const std::vector<MatrixCell>& cells) {
  std::string csv =
      "scenario,paper_section,variant,ablation,outcome,fell_at,simulated_time,passed,metric,label,"
      "unit,measured,at_least,at_most,check_passed,paper,paper_value\n";
  for (const MatrixCell& cell : cells) {
    const std::string run =
        fmt::format("{},{},{},{}", CsvCell(cell.scenario), CsvCell(cell.paper_section),
                    CsvCell(cell.variant), CsvCell(cell.ablation));
    if (cell.problem) {
      csv += fmt::format("{},{},,,,,,,,,,,,\n", run, CsvCell("could not be run: " + *cell.problem));
    }
    for (const CheckResult& check : cell.checks) {
      csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", run, CsvCell(cell.outcome),
                         CsvNumber(cell.fell_at), cell.simulated_time, Truth(cell.passed),
                         CsvCell(check.name), CsvCell(check.label), CsvCell(check.unit),
                         CsvNumber(check.measured), CsvNumber(check.at_least),
                         CsvNumber(check.at_most), check.limited() ? Truth(check.passed) : "",
                         CsvCell(check.paper), CsvNumber(check.paper_value));
    }
  }
  return csv;
}

Json MatrixCharts(const std::vector<MatrixCell>& cells) {
  std::vector<std::string> scenarios, columns;
  Json rows = Json::array(), parts = Json::array();
  for (size_t i = 0; i < cells.size(); ++i) {
    if (!cells[i].variant.empty()) continue;  // of one scenario alone: it is in that one's part
    const size_t column = IndexOf(ColumnTitle(cells[i]), &columns);
    rows.push_back(CellRow(cells[i], i, {column, IndexOf(cells[i].scenario, &scenarios)}));
  }
  parts.push_back({{"name", "matrix"},
                   {"kind", "matrix"},
                   {"command", ""},
                   {"variables",
                    {{{"name", "controller"}, {"unit", ""}, {"choices", columns}},
                     {{"name", "scenario"}, {"unit", ""}, {"choices", scenarios}}}},
                   {"values", Json::array()},
                   {"maps", Json::array({{{"x", 0}, {"y", 1}}})},
                   {"rows", rows}});
  for (const std::vector<const MatrixCell*>& group : ByScenario(cells)) {
    parts.push_back(ScenarioPart(group));
  }
  return {{"format", kChartsFormat},
          {"title", "Experiments with and without parts of the controller"},
          {"description", ""},
          {"text", WithoutTones(FormatMatrix(cells))},
          {"parts", parts}};
}

}  // namespace poise
