// Pages that open from disk: of a run (docs/reference/report_format.md), of charts
// (docs/reference/charts.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "logging/run_record.h"
#include "tools/report/report.h"
#include "tools/robot/robot_check.h"
#include "tools/robot/robot_drawing.h"
#include "tools/scenario/scenario.pb.h"

namespace poise {

/// One run of a page: its log, what was read from it, and its scenario as it was run.
struct ReportedRun {
  std::string log;
  logging::RunRecord record;
  Scenario scenario;
  std::vector<CheckResult> checks;
};

/// What a page says of a run beside its messages: RunJson, and of its log.
nlohmann::ordered_json PageRunJson(const logging::RunRecord& record, const Scenario& scenario,
                                   const std::vector<CheckResult>& checks);

inline constexpr double kPageSize = 30;  // MB: opens in seconds, goes by mail

/// Writes the page with the first run, and the others drawn over it, in about `megabytes` at most:
/// of a run too long for that it shows rows of several ticks (docs/reference/report_format.md).
/// Throws ConfigError: the page's template is not built, `file` cannot be written or is a log;
/// LogError for a log that is gone. A page that is not finished leaves `file` as it was.
void WriteHtmlReport(const std::filesystem::path& file, const std::vector<ReportedRun>& runs,
                     double megabytes = kPageSize);

inline constexpr char kChartsFile[] = "charts.json";
inline constexpr char kChartsPage[] = "charts.html";
inline constexpr int kChartsFormat = 1;

/// Writes charts.json (docs/reference/charts.md) into `folder`, and charts.html, which draws it;
/// says on stderr why there is no page. Throws ConfigError where the data cannot be written.
void WriteCharts(const std::filesystem::path& folder, const nlohmann::ordered_json& charts);

/// Writes the page of the charts.json in `folders`, laid over each other. Throws ConfigError as
/// WriteHtmlReport, and for a folder without such a file.
void WriteChartsPage(const std::filesystem::path& file,
                     const std::vector<std::filesystem::path>& folders);

/// Writes the page of a robot that was checked. Throws ConfigError likewise.
void WriteRobotPage(const std::filesystem::path& file, const RobotCheck& check,
                    const RobotDrawing& drawing);

/// The page of a run in progress: no ticks, which come from its stream. `channels` as in
/// docs/reference/report_format.md, `keep` the ticks that it holds. Throws ConfigError: the
/// template is not built.
std::string LiveHtml(const logging::RunRecord& record, const Scenario& scenario,
                     nlohmann::ordered_json channels, int64_t keep);

}  // namespace poise
