#include "tools/report/matrix_table.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "fmt/format.h"
#include "tools/cli/text_table.h"

namespace poise {
namespace {

std::string ColumnTitle(const MatrixCell& cell) {
  if (!cell.variant.empty()) return "variant " + cell.variant;
  std::string title = cell.ablation;
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
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

/// The cells of one scenario.
std::string FormatScenario(const std::vector<const MatrixCell*>& cells) {
  std::vector<TableRow> rows = {{"what", "paper"}, {"outcome", ""}};
  std::vector<const CheckResult*> figures;  // in the order in which the cells have them
  for (const MatrixCell* cell : cells) {
    rows[0].emplace_back(ColumnTitle(*cell));
    for (const CheckResult& check : cell->checks) {
      const auto same = [&](const CheckResult* other) { return Same(*other, check); };
      const bool paper = !check.paper.empty() || check.paper_value;
      if (paper && std::none_of(figures.begin(), figures.end(), same)) figures.push_back(&check);
    }
  }
  for (const MatrixCell* cell : cells) {
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
          check == nullptr ? "" : fmt::format("{}{}", FormatMeasured(*check), failed ? " !" : "");
      row.emplace_back(text, failed ? Tone::kBad : Tone::kPlain);
    }
    rows.push_back(std::move(row));
  }
  return FormatColumns(rows);
}

/// What each part of the controller is worth: a row for each ablation, a column for each scenario.
std::string FormatOverview(const std::vector<MatrixCell>& cells) {
  std::vector<TableRow> rows(1, TableRow{TableCell("")});
  std::vector<std::string> scenarios;
  std::vector<std::string> ablations;
  const auto index = [](std::vector<std::string>* names, const std::string& name) {
    const auto found = std::find(names->begin(), names->end(), name);
    const auto at = static_cast<size_t>(found - names->begin());
    if (found == names->end()) names->push_back(name);
    return at;
  };
  for (const MatrixCell& cell : cells) {
    if (!cell.variant.empty()) continue;
    const size_t column = 1 + index(&scenarios, cell.scenario);
    const size_t row = 1 + index(&ablations, cell.ablation);
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

std::string Number(const std::optional<double>& value) {
  return value ? fmt::format("{}", *value) : "";
}

std::string Truth(bool value) { return value ? "true" : "false"; }

}  // namespace

void ReadCellSummary(const std::filesystem::path& file, MatrixCell* cell) {
  std::ifstream in(file);
  const nlohmann::json summary = nlohmann::json::parse(in);
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
  bool failed = false;
  for (size_t begin = 0; begin < cells.size();) {
    std::vector<const MatrixCell*> group;
    size_t end = begin;
    for (; end < cells.size() && cells[end].scenario == cells[begin].scenario; ++end) {
      group.push_back(&cells[end]);
      failed = failed || (!cells[end].problem && !cells[end].passed);
    }
    const MatrixCell& first = cells[begin];
    text += Wrapped(fmt::format("{}{}{}: {}", first.paper_section,
                                first.paper_section.empty() ? "" : "  ", first.scenario,
                                first.description),
                    ScreenStyle().columns, 2) +
            "\n";
    text += FormatScenario(group) + "\n";
    begin = end;
  }
  if (failed) {
    text += Wrapped(
                "!: outside the limit that the scenario's check sets; at the outcome: a check "
                "that is not shown failed, see poise report",
                ScreenStyle().columns, 3) +
            "\n";
  }
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
                         Number(cell.fell_at), Number(cell.simulated_time), Truth(cell.passed),
                         CsvCell(check.name), CsvCell(check.label), CsvCell(check.unit),
                         Number(check.measured), Number(check.at_least), Number(check.at_most),
                         check.limited() ? Truth(check.passed) : "", CsvCell(check.paper),
                         Number(check.paper_value));
    }
  }
  return csv;
}

}  // namespace poise
