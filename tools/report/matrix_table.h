// The results of `poise matrix`, as tables, as CSV and as data of charts.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/report/report.h"

namespace poise {

/// One scenario, or a variant of it, run with one ablation.
struct MatrixCell {
  std::string scenario;
  std::string description;
  std::string paper_section;
  std::string variant;                 ///< empty: the scenario itself
  std::string ablation;                ///< name of one of Ablations()
  std::string command;                 ///< makes it
  std::string folder;                  ///< its run's, below the matrix'
  bool must_pass = false;              ///< an experiment without ablation, with checks of its own
  std::optional<std::string> problem;  ///< why it could not be run; the rest is then empty
  std::string started_at;              ///< ISO 8601 UTC
  bool passed = false;
  std::string outcome;            ///< "stands", "fell at 1.234 s", "stopped at 1.234 s: reason"
  std::optional<double> fell_at;  ///< s
  double simulated_time = 0;      ///< s
  std::vector<CheckResult> checks;
};

/// Fills in the cell's results from a run's summary.json. Throws std::exception when it is missing
/// or is none.
void ReadCellSummary(const std::filesystem::path& file, MatrixCell* cell);

/// A table for each scenario: a column for each of its cells, rows for the outcome and for each
/// check that has a figure of the paper. The outcome of a run that failed by a check without a row
/// is marked. Cells of a scenario stand together.
std::string FormatMatrix(const std::vector<MatrixCell>& cells);

/// A line for each check of each cell, below a line with the columns' names (RFC 4180). A cell that
/// could not be run has one line, without check.
std::string MatrixCsv(const std::vector<MatrixCell>& cells);

/// charts.json (docs/reference/charts.md): what stands by scenario and ablation, then of each
/// scenario the checks that have a figure of the paper.
nlohmann::ordered_json MatrixCharts(const std::vector<MatrixCell>& cells);

}  // namespace poise
