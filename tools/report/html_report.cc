#include "tools/report/html_report.h"

#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <sstream>

#include "components/framework/configuration/configuration.h"
#include "components/framework/modules.h"
#include "derived/message_traits.hpp"
#include "fmt/format.h"
#include "lcmtypes/field_table.h"
#include "logging/channel_ticks.h"
#include "logging/events/events.h"
#include "logging/export/column_codec.h"
#include "logging/export/signal_table.h"
#include "logging/partial_file.h"
#include "tools/report/ground_json.h"
#include "tools/report/run_story.h"
#include "tools/robot/robot_json.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::string_view kDataMark = "<!--POISE-RUN-DATA-->";

// What a megabyte of page holds, fitted to runs of 12 joints: numbers take about 1.5 bytes where
// each tick is there, and about 4 with their bounds.
constexpr double kNumbersPerMegabyte = 0.65e6;      // ticks times signals: each tick is there
constexpr double kBoundNumbersPerMegabyte = 0.2e6;  // rows times signals, else
constexpr int64_t kLeastRows = 500;

// Around which events every tick is shown, the first ones first.
constexpr const char* kFocus[] = {
    "fall",         "bridge_state",   "step_needed", "contact_lost",    "push_peak",
    "push_begins",  "contact_early",  "no_surface",  "touch_down",      "support_changed",
    "contact_late", "phase_began",    "push_ends",   "balancing_on",    "eta_infeasible_begins",
    "crane_let_go", "loading_begins", "searching",   "unloading_begins"};

constexpr char kReportPage[] = "report.html";

/// PREFIX/share/poise/NAME where Poise is installed; else build/web/NAME, beside
/// build/PRESET/bin/poise.
fs::path TemplatePath(const char* name) {
  const fs::path prefix = InstalledPrefix();
  if (!prefix.empty()) return prefix / "share" / "poise" / name;
  return fs::read_symlink("/proc/self/exe").parent_path() / ".." / ".." / "web" / name;
}

std::string ReadTemplate(const char* name) {
  const fs::path path = TemplatePath(name);
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  if (!in || !(text << in.rdbuf())) {
    throw ConfigError(
        fmt::format("{}: is not built; run deploy/setup{}", path.lexically_normal().string(),
                    name == std::string_view(kReportPage) ? ", or give --no-html" : ""));
  }
  if (text.view().find(kDataMark) == std::string_view::npos) {
    throw ConfigError(fmt::format("{}: is no template of a page; run deploy/setup",
                                  path.lexically_normal().string()));
  }
  return text.str();
}

/// JSON that can stand in a <script>: any bytes that logs hold, and no tag.
std::string ScriptText(const Json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

Json ScenarioJson(const Scenario& scenario) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;  // with the defaults of what is not set
  options.preserve_proto_field_names = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(scenario, &text, options);
  if (!status.ok()) {
    throw ConfigError(fmt::format("scenario: cannot be written as JSON: {}", status.ToString()));
  }
  return Json::parse(text);
}

/// Packs columns and writes each distinct one once, as an element of the page.
class BlobWriter {
 public:
  BlobWriter(std::ostream* out, size_t run) : out_(out), run_(run) {}

  /// {"value"} of a column of one value, else {"blob", "step", "order"}.
  Json Add(std::span<const double> values, bool integer) {
    return Add(values, [&] { return logging::PackColumn(values, integer); });
  }
  Json AddBound(std::span<const double> values, logging::Bound bound, bool integer) {
    return Add(values, [&] { return logging::PackBound(values, bound, integer); });
  }

 private:
  Json Add(std::span<const double> values, const std::function<logging::PackedColumn()>& pack) {
    const double first = values.front();
    if (std::ranges::all_of(values, [first](double x) { return x == first; })) {
      return {{"value", first}};
    }
    if (std::ranges::none_of(values, [](double x) { return std::isfinite(x); })) {
      return {{"value", nullptr}};
    }
    logging::PackedColumn column = pack();
    const auto [blob, added] =
        blobs_.try_emplace(std::move(column.data), fmt::format("run{}-{}", run_, blobs_.size()));
    if (added) {
      *out_ << "<script type=\"application/octet-stream\" id=\"" << blob->second << "\">"
            << blob->first << "</script>\n";
    }
    return {{"blob", blob->second}, {"step", column.step}, {"order", column.order}};
  }

  std::ostream* out_;
  size_t run_;
  std::map<std::string, std::string> blobs_;  // id by content
};

/// Writes the channels of a page with a row a tick, or with `rows` that hold several.
Json ChannelsJson(const std::vector<logging::ChannelColumns>& channels, bool rows,
                  int64_t num_ticks, BlobWriter* blobs) {
  constexpr double kFew = 0.2;  // of the ticks, as in web/src/data.js
  Json json = Json::array();
  for (const logging::ChannelColumns& channel : channels) {
    Json item = {{"name", channel.name}, {"type", channel.type}, {"count", channel.messages}};
    if (rows && static_cast<double>(channel.messages) < kFew * static_cast<double>(num_ticks)) {
      item["sparse"] = true;
    }
    if (!rows && channel.messages != num_ticks) {
      const std::vector<double> ticks(channel.ticks.begin(), channel.ticks.end());
      item["ticks"] = blobs->Add(ticks, true);
    }
    item["signals"] = Json::array();
    for (const logging::SignalColumn& column : channel.columns) {
      Json signal = {{"field", column.field}, {"integer", column.integer}};
      signal.update(blobs->Add(column.values, column.integer));
      const auto same = [](double a, double b) {
        return a == b || (std::isnan(a) && std::isnan(b));
      };
      if (!std::ranges::equal(column.least, column.largest, same)) {
        signal["least"] = blobs->AddBound(column.least, logging::Bound::kLeast, column.integer);
        signal["largest"] =
            blobs->AddBound(column.largest, logging::Bound::kLargest, column.integer);
      }
      item["signals"].push_back(std::move(signal));
    }
    json.push_back(std::move(item));
  }
  return json;
}

/// The rows of a run that may take `megabytes` of a page.
logging::PageRows RowsOf(const logging::RunRecord& record,
                         const std::vector<logging::Event>& events, double megabytes) {
  const int64_t first = record.spec.cut().first_tick();
  const std::array<int32_t, 2> joints_and_feet{record.robot.num_joints(), 2};
  double signals =
      static_cast<double>(MessageTraits<derived::signals_t>::EncodedSize(joints_and_feet)) / 8;
  for (const Channel& channel : record.spec.graph().channel()) {
    signals += static_cast<double>(logging::MessageSize(channel)) / 8;
  }
  const double share = megabytes / signals;
  if (static_cast<double>(record.num_ticks - first) <= kNumbersPerMegabyte * share) {
    return logging::PageRows(first, record.num_ticks);
  }
  std::vector<int64_t> focus;
  for (const char* const name : kFocus) {
    for (const logging::Event& event : events) {
      if (event.name != name) continue;
      focus.push_back(std::llround(event.time / record.spec.tick_period()) +
                      record.spec.lead_ticks());
    }
  }
  return logging::PageRows(
      first, record.num_ticks,
      std::max(kLeastRows, static_cast<int64_t>(kBoundNumbersPerMegabyte * share)),
      record.spec.tick_period(), focus);
}

/// The log's name in its folder: a page says nothing of the rest of the machine.
std::string LogName(const std::string& log) {
  const fs::path path = fs::weakly_canonical(fs::absolute(log));
  return (path.parent_path().filename() / path.filename()).string();
}

/// What a page knows of a run beside its ticks.
Json Metadata(const logging::RunRecord& record, const Scenario& scenario,
              const std::vector<CheckResult>& checks) {
  Json json;
  json["format"] = 1;
  json["run"] = PageRunJson(record, scenario, checks);
  json["scenario"] = ScenarioJson(scenario);
  json["scenario_text"] = record.info.scenario;
  json["robot"] = RobotJson(record);
  json["ground"] = GroundJson(scenario.sim(), record.spec.seed());
  json["story"] = "";
  json["events"] = Json::array();
  json["messages"] = Json::array();  // the page has Poise's own
  for (const std::string_view file : MessageDefinitions()) {
    if (file.find("package poise;") == std::string_view::npos) json["messages"].push_back(file);
  }
  return json;
}

/// `what`: "run", "robot" or "charts".
void WriteData(const char* what, const Json& json, std::ostream* out) {
  *out << "<script type=\"application/json\" class=\"poise-" << what << "\">" << ScriptText(json)
       << "</script>\n";
}

void WriteRun(const ReportedRun& run, size_t index, double megabytes, std::ostream* out) {
  Json json = Metadata(run.record, run.scenario, run.checks);
  json["run"]["log"] = LogName(run.log);
  const std::vector<logging::Event> events = logging::Events(run.record);
  json["events"] = EventsJson(events);
  json["story"] = TellRun(run.record, run.checks, events, "");
  BlobWriter blobs(out, index);
  const logging::PageRows rows = RowsOf(run.record, events, megabytes);
  if (!rows.every_tick()) {
    json["rows"] = Json::array();
    for (const logging::RowSpan& span : rows.spans()) {
      json["rows"].push_back({span.first_tick, span.stride, span.count});
    }
    json["events_without_detail"] = rows.left_out();
  }
  const std::vector<logging::ChannelColumns> channels =
      rows.every_tick() ? logging::ReadColumns(run.log, run.record)
                        : logging::ReadRows(run.log, run.record, rows);
  json["channels"] = ChannelsJson(channels, !rows.every_tick(), run.record.num_ticks, &blobs);
  WriteData("run", json, out);
}

/// The template with what `write` says of its runs.
void WritePage(const char* name, std::ostream* out, const std::function<void()>& write) {
  const std::string page = ReadTemplate(name);
  const size_t mark = page.find(kDataMark);
  *out << std::string_view(page).substr(0, mark);
  write();
  *out << std::string_view(page).substr(mark + kDataMark.size());
}

/// What `write` writes, or `file` as it was. Throws ConfigError; `flag` names the file.
void WriteFile(const fs::path& file, const char* flag,
               const std::function<void(std::ostream* out)>& write) {
  const auto with_flag = [&](const auto& act) {
    try {
      act();
    } catch (const logging::LogError& error) {
      throw ConfigError(fmt::format("{}; name another file with {}", error.what(), flag));
    }
  };
  std::optional<logging::CheckedFile> page;
  with_flag([&] { page.emplace(file.string()); });
  write(page->stream());
  with_flag([&] { page->Close(); });
}

void WriteChartsData(const fs::path& file, const char* flag, const std::vector<Json>& sets) {
  WriteFile(file, flag, [&](std::ostream* out) {
    WritePage(kChartsPage, out, [&] {
      for (const Json& set : sets) WriteData("charts", set, out);
    });
  });
}

}  // namespace

Json PageRunJson(const logging::RunRecord& record, const Scenario& scenario,
                 const std::vector<CheckResult>& checks) {
  Json json = RunJson(scenario, record, checks);
  json["run_id"] = std::to_string(record.spec.run_id());  // beyond a double's integers
  json["damages"] = record.damages;
  return json;
}

void WriteHtmlReport(const fs::path& file, const std::vector<ReportedRun>& runs, double megabytes) {
  for (const ReportedRun& run : runs) {
    std::error_code other;
    if (!fs::equivalent(file, run.log, other)) continue;
    throw ConfigError(
        fmt::format("{}: is the log itself; name another file with --html", file.string()));
  }
  WriteFile(file, "--html", [&](std::ostream* out) {
    WritePage(kReportPage, out, [&] {
      const double share = megabytes / static_cast<double>(runs.size());
      for (size_t i = 0; i < runs.size(); ++i) WriteRun(runs[i], i, share, out);
    });
  });
}

void WriteCharts(const fs::path& folder, const Json& charts) {
  WriteFile(folder / kChartsFile, "--out", [&](std::ostream* out) {
    *out << charts.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  });
  try {
    WriteChartsData(folder / kChartsPage, "--out", std::vector<Json>(1, charts));
  } catch (const ConfigError& error) {
    fmt::print(stderr, "poise: {} is not written: {}\n", kChartsPage, error.what());
  }
}

void WriteChartsPage(const fs::path& file, const std::vector<fs::path>& folders) {
  std::vector<Json> sets;
  for (const fs::path& folder : folders) {
    const fs::path data = folder / kChartsFile;
    try {
      sets.push_back(Json::parse(ReadFile(data.string())));
    } catch (const Json::exception& error) {
      throw ConfigError(fmt::format("{}: is no data of charts: {}", data.string(), error.what()));
    }
    // Where its runs lie, from the page.
    sets.back()["folder"] = fs::relative(folder, fs::absolute(file).parent_path()).string();
  }
  WriteChartsData(file, "--html", sets);
}

void WriteRobotPage(const fs::path& file, const RobotCheck& check, const RobotDrawing& drawing) {
  const robot::RobotState& stance = check.stance;
  const Eigen::Vector3d& at = stance.base_position;
  const Eigen::Quaterniond& turn = stance.base_orientation;
  Json json;
  json["robot"] = RobotJson(check.model, drawing);
  json["stance"]["base"] = {{"position", {at.x(), at.y(), at.z()}},
                            {"orientation", {turn.w(), turn.x(), turn.y(), turn.z()}}};
  json["stance"]["joints"] =
      std::vector<double>(stance.joint_position.begin(), stance.joint_position.end());
  json["check"] = RobotCheckJson(check);
  json["drawn_instead"] = WhatIsDrawnInstead(drawing);
  json["triangles"] = {drawing.triangles, drawing.file_triangles};
  WriteFile(file, "--page", [&](std::ostream* out) {
    WritePage(kReportPage, out, [&] { WriteData("robot", json, out); });
  });
}

std::string LiveHtml(const logging::RunRecord& record, const Scenario& scenario, Json channels,
                     int64_t keep) {
  Json json = Metadata(record, scenario, {});
  json["channels"] = std::move(channels);
  json["live"] = {{"keep", keep}};
  std::ostringstream out;
  WritePage(kReportPage, &out, [&] { WriteData("run", json, &out); });
  return std::move(out).str();
}

}  // namespace poise
