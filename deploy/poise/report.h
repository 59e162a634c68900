// The table and the summary at the end of a run.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "deploy/poise/run_outcome.h"
#include "deploy/poise/scenario.pb.h"
#include "logging/run_record.h"

namespace poise {

/// A row of the table.
struct CheckResult {
  std::string name;  ///< the metric's
  std::string label;
  std::string unit;
  std::optional<double> measured;
  std::optional<double> at_most;
  std::optional<double> at_least;
  std::string paper;
  std::optional<double> paper_value;
  bool passed = true;  ///< a row without limit always passes
  bool limited() const { return at_most || at_least; }
};

/// First tick at or after check_from.
int64_t FirstCheckedTick(const Scenario& scenario, const logging::RunRecord& run);

/// The scenario's checks on a run, after two of every run: it reached its planned end, and its log
/// is whole.
std::vector<CheckResult> EvaluateChecks(const Scenario& scenario, const logging::RunRecord& run);

/// Columns what, measured, limit, paper, verdict.
std::string FormatTable(const std::vector<CheckResult>& checks);
/// The scenario's assumptions with the values they have.
std::string FormatAssumptions(const Scenario& scenario);

/// What summary.json says of the run itself, without how it was run and how it ended.
nlohmann::ordered_json RunJson(const Scenario& scenario, const logging::RunRecord& run,
                               const std::vector<CheckResult>& checks);

/// All that summary.json says. `outcome` of the run just ended.
std::string SummaryJson(const Scenario& scenario, const logging::RunRecord& run,
                        const RunOutcome& outcome, const std::string& mode,
                        const std::vector<CheckResult>& checks, bool passed);

}  // namespace poise
