#include "tools/run/several_runs.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <utility>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/exit_code.h"
#include "tools/cli/signals.h"
#include "tools/cli/text_table.h"
#include "tools/run/run_dir.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

/// The numbers of "7.1.2": sections in the order of a book.
std::vector<int64_t> SectionNumbers(std::string_view section) {
  std::vector<int64_t> numbers;
  bool in_number = false;
  for (const char c : section) {
    const bool digit = c >= '0' && c <= '9';
    if (digit && !in_number) numbers.push_back(0);
    if (digit) numbers.back() = std::min<int64_t>(numbers.back() * 10 + (c - '0'), 1'000'000);
    in_number = digit;
  }
  return numbers;
}

/// Files of every scenario with a paper_section, by section, then by name.
std::vector<std::string> Experiments() {
  std::vector<std::pair<std::vector<int64_t>, std::string>> found;  // sections and files
  for (const std::string& name : ListNames("scenarios")) {
    // The scenario is read by its path: a file of that name in the current folder is not the
    // experiment.
    const std::string file = InstalledFile("scenarios", name).string();
    const Scenario scenario = ScenarioFiles(file).Merged();
    if (!scenario.paper_section().empty()) {
      found.emplace_back(SectionNumbers(scenario.paper_section()), file);
    }
  }
  std::sort(found.begin(), found.end());
  std::vector<std::string> names;
  for (auto& [section, name] : found) names.push_back(std::move(name));
  if (names.empty()) throw ConfigError("no scenario has a paper_section; name the ones to run");
  return names;
}

std::string FormatOverview(const std::vector<ScenarioRun>& runs,
                           const std::vector<RunResult>& results) {
  std::vector<TableRow> rows = {{"section", "scenario", "verdict", "what", "measured", "paper"}};
  std::string problems;
  for (size_t i = 0; i < runs.size(); ++i) {
    const bool ran = i < results.size();
    const bool passed = ran && results[i].summary.passed;
    rows.push_back({runs[i].scenario().paper_section(), runs[i].name(),
                    TableCell(!ran     ? "not run"
                              : passed ? "passed"
                                       : "FAILED",
                              passed ? Tone::kGood : Tone::kBad),
                    "", "", ""});
    if (!ran) continue;
    if (!results[i].problem.empty()) {
      problems += fmt::format("{}: {}\n", runs[i].name(), results[i].problem);
    }
    bool first = true;
    for (const CheckResult& check : results[i].summary.checks) {
      if (check.paper.empty()) continue;
      if (!first) rows.push_back({"", "", "", "", "", ""});
      first = false;
      rows.back()[3] = check.label;
      rows.back()[4] = {FormatMeasured(check), check.passed ? Tone::kPlain : Tone::kBad};
      rows.back()[5] = check.paper;
    }
  }
  return fmt::format("{}{}", FormatColumns(rows), problems);
}

}  // namespace

std::vector<std::string> ExpandScenarios(const std::vector<std::string>& names) {
  std::vector<std::string> expanded;
  for (const std::string& name : names) {
    if (name == kAllScenarios) {
      const std::vector<std::string> all = Experiments();
      expanded.insert(expanded.end(), all.begin(), all.end());
    } else {
      expanded.push_back(name);
    }
  }
  return expanded;
}

std::string UniqueName(const std::string& name, std::set<std::string>* taken) {
  std::string unique = name;
  for (int i = 2; !taken->insert(unique).second; ++i) unique = fmt::format("{}-{}", name, i);
  return unique;
}

namespace {

/// True when all passed.
bool RunSeveral(const std::vector<std::string>& names, const RunOptions& options,
                const std::string& out) {
  std::vector<ScenarioRun> runs;
  for (const std::string& name : ExpandScenarios(names)) runs.emplace_back(name, options);
  LogSizes sizes;
  for (const ScenarioRun& run : runs) sizes.Add(run.log_sizes());
  CheckSpace(out.empty() ? RunsDir() : fs::path(out), sizes, options.force);
  const bool all = names.size() == 1;
  const RunDir folder = MakeRunDir(out, all ? kAllScenarios : "several", options.force);
  CatchStopSignals();
  std::vector<RunResult> results;
  std::set<std::string> taken;
  for (ScenarioRun& run : runs) {
    if (StopSignal() != 0) break;
    const std::string name = UniqueName(run.name(), &taken);
    if (options.quiet) {
      fmt::print("{}: ", name);
      std::fflush(stdout);
    }
    const fs::path dir = folder.path() / name;
    try {
      results.push_back(run.Run(dir.string(), /*latest=*/true));
    } catch (const std::exception& error) {
      std::fflush(stdout);
      fmt::print(stderr, "poise: {}: {}\n", name, error.what());
      fmt::print("FAILED\n");
      results.push_back({{}, dir, error.what()});
    }
    if (!options.quiet) fmt::print("\n");
  }
  bool passed = results.size() == runs.size();
  for (const RunResult& result : results) passed = passed && result.summary.passed;
  if (!options.quiet) {
    fmt::print("{}\n{}\n", FormatOverview(runs, results), folder.path().string());
  }
  fmt::print("{}\n", passed ? "all passed" : "FAILED");
  return passed;
}

}  // namespace

int RunScenarios(const std::vector<std::string>& names, const RunOptions& options,
                 const std::string& out) {
  if (names.size() != 1 || names.front() == kAllScenarios) {
    return RunSeveral(names, options, out) ? kExitOk : kExitFailed;
  }
  const RunResult result = ScenarioRun(names.front(), options).Run(out, /*latest=*/out.empty());
  if (result.summary.failed_by_machine) return kExitMachine;
  return result.summary.passed ? kExitOk : kExitFailed;
}

}  // namespace poise
