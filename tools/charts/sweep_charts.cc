#include "tools/charts/sweep_charts.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/charts/sweep_edge.h"
#include "tools/charts/sweep_labels.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_style.h"
#include "tools/cli/text_table.h"
#include "tools/report/html_report.h"
#include "tools/scenario/catalog.h"
#include "tools/sweep/sweep_points.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kStandsValue[] = "stands";

/// "poise run ..." of all that a sweep's runs have in common.
std::string CommandOf(const Sweep& sweep, const std::string& what) {
  std::string command = "poise run ";
  if (!what.empty()) {
    command += what;
  } else {
    // The scenario is called by its name where that leads to the same file.
    std::string scenario = sweep.scenario();
    const std::string name = fs::path(scenario).stem().string();
    try {
      if (FindFile("scenarios", name, fs::current_path()) == fs::path(scenario)) scenario = name;
    } catch (const ConfigError&) {
      // The name leads nowhere: the file itself is named.
    }
    command += ShellWord(scenario);
  }
  if (sweep.has_variant()) command += " --variant " + ShellWord(sweep.variant());
  for (const std::string& part : sweep.without()) command += " --without " + ShellWord(part);
  if (sweep.ideal()) command += " --ideal";
  if (sweep.has_drives()) command += " --drives " + ShellWord(sweep.drives());
  for (const std::string& set : sweep.set()) command += " --set " + ShellWord(set);
  return command;
}

class Part {
 public:
  Part(const SweepHeader& header, const SweepRows& rows, const fs::path& folder)
      : header_(header),
        sweep_(header.sweep),
        rows_(rows),
        points_(sweep_),
        logs_(!folder.empty() && fs::is_directory(folder / "logs") ? folder : fs::path()) {}

  Json Variables() const;
  /// Adds values, maps, same and rows to `part`.
  void AddSweep(Json* part) const;
  void AddLimits(Json* part) const;

 private:
  const Variable& variable(int i) const { return sweep_.vary(i); }
  /// Whether the limit is that of one point, whose runs are then told like a sweep's.
  bool OfOnePoint() const { return sweep_.has_limit() && count() == 0; }
  int count() const { return sweep_.vary_size(); }
  int Find(const std::string& name) const;
  std::optional<double> Value(const SweepRow& row, const std::string& metric) const;
  std::string SameSentence(const std::string& metric) const;
  Json SweepMaps(Json* same) const;
  /// A row without its values: of the run `row`.
  Json RowJson(const SweepRow& row, const std::string& outcome, const std::string& told) const;

  const SweepHeader& header_;
  const Sweep& sweep_;
  const SweepRows& rows_;
  SweepPoints points_;
  fs::path logs_;  ///< the folder in which logs/ is; empty: no run was kept
};

Json Part::Variables() const {
  Json json = Json::array();
  for (const Variable& variable : sweep_.vary()) {
    Json one = {{"name", PlainName(variable)}, {"unit", UnitOf(variable)}};
    if (variable.angle()) one["angle"] = true;
    for (const Choice& choice : variable.choice()) one["choices"].push_back(choice.name());
    if (sweep_.has_random() && variable.choice_size() == 0 && variable.value_size() == 0) {
      one["drawn"] = true;
    }
    json.push_back(std::move(one));
  }
  if (OfOnePoint()) {
    json.push_back({{"name", PlainName(sweep_.limit())}, {"unit", UnitOf(sweep_.limit())}});
  }
  return json;
}

int Part::Find(const std::string& name) const {
  int i = 0;
  while (i < count() && NameOf(variable(i)) != name) ++i;
  return i;
}

std::optional<double> Part::Value(const SweepRow& row, const std::string& metric) const {
  const auto found = row.metrics.find(metric);
  if (!row.survived() || found == row.metrics.end()) return {};
  return found->second;
}

Json Part::RowJson(const SweepRow& row, const std::string& outcome, const std::string& told) const {
  Json json = {{"run", row.run}, {"at", Json::array()}, {"outcome", outcome}, {"told", told}};
  json["values"] = Json::array();
  for (const SweepValue& value : points_.At(row.run)) {
    json["at"].push_back(value.choice >= 0 ? Json(value.choice) : Json(value.number));
  }
  if (OfOnePoint()) json["at"].push_back(*row.limit);
  try {
    std::string changes;
    for (const std::string& set : points_.Changes(row.run, row.limit)) {
      changes += " --set " + ShellWord(set);
    }
    json["set"] = changes;
  } catch (const ConfigError&) {
    // An expression has no value: there is no command of an invalid run.
  }
  if (logs_.empty()) return json;
  std::string log = fmt::format("logs/{}", row.run);
  if (row.limit) log += fmt::format("/{}", *row.limit);
  if (fs::is_directory(logs_ / log)) json["log"] = log;
  return json;
}

/// Says of a metric that all runs that stand agree on it, or that none knows it; else empty.
std::string Part::SameSentence(const std::string& metric) const {
  std::optional<double> first;
  for (const auto& [key, row] : rows_) {
    const std::optional<double> here = row.stands() ? Value(row, metric) : std::nullopt;
    if (first && here && *here != *first) return "";
    if (here) first = here;
  }
  return fmt::format("{}: {}", MetricLabel(metric),
                     first ? FormatNumber(*first, MetricUnit(metric)) : "none");
}

Json Part::SweepMaps(Json* same) const {
  Json maps = Json::array();
  const auto column = [&](const std::string& metric) {
    return std::ranges::find(header_.columns, metric) - header_.columns.begin();
  };
  for (const SweepMap& map : sweep_.map()) {
    Json json = {{"x", Find(map.x())}};
    if (map.has_y()) json["y"] = Find(map.y());
    if (map.value() != kStandsValue) json["value"] = column(map.value());
    maps.push_back(std::move(json));
  }
  if (!maps.empty()) return maps;
  if (count() == 1 || OfOnePoint()) {
    // Over seeds, which have no order, a point at 0 or 1 for each tells less than the table.
    if (OfOnePoint() || !IsSeed(variable(0))) maps.push_back({{"x", 0}});
    for (const std::string& metric : header_.columns) {
      std::string sentence = SameSentence(metric);
      if (sentence.empty()) {
        maps.push_back({{"x", 0}, {"value", column(metric)}});
      } else {
        same->push_back(std::move(sentence));
      }
    }
  }
  for (int y = 0; y < count(); ++y) {
    for (int x = 0; x < y; ++x) {
      if (!IsSeed(variable(x)) && !IsSeed(variable(y))) maps.push_back({{"x", x}, {"y", y}});
    }
  }
  return maps;
}

void Part::AddSweep(Json* part) const {
  Json values = Json::array(), same = Json::array(), rows = Json::array();
  for (const std::string& metric : header_.columns) {
    values.push_back(
        {{"name", metric}, {"label", MetricLabel(metric)}, {"unit", MetricUnit(metric)}});
  }
  for (const auto& [key, row] : rows_) {
    std::string told = row.stands() || row.fell() ? row.outcome : row.Ending();
    if (row.fell_at) told += fmt::format(" at {} s", FormatNumber(*row.fell_at));
    if (!row.phase.empty()) told += fmt::format(", phase {}", row.phase);
    if (!row.trouble.empty()) told += ", " + row.trouble;
    rows.push_back(RowJson(row, row.outcome, told));
    for (const std::string& metric : header_.columns) {
      rows.back()["values"].push_back(OrNull(Value(row, metric)));
    }
  }
  (*part)["values"] = std::move(values);
  (*part)["maps"] = SweepMaps(&same);
  (*part)["same"] = std::move(same);
  (*part)["rows"] = std::move(rows);
}

void Part::AddLimits(Json* part) const {
  using Get = std::function<std::optional<double>(const LimitPoint&)>;
  const auto push = [](const LimitPoint& p) -> const PushBound* {
    return p.at_limit != nullptr && p.at_limit->push ? &*p.at_limit->push : nullptr;
  };
  const auto share = [push](double PushBound::*of) -> Get {
    return [push, of](const LimitPoint& p) -> std::optional<double> {
      const PushBound* const bound = push(p);
      if (bound == nullptr || !bound->bounded() || !(bound->*of > 0)) return {};
      return bound->impulse / bound->*of;
    };
  };
  const auto impulse = [push](bool per_mass) -> Get {
    return [push, per_mass](const LimitPoint& p) -> std::optional<double> {
      const PushBound* const bound = push(p);
      if (bound == nullptr) return {};
      return per_mass ? bound->impulse / bound->mass : bound->impulse;
    };
  };
  struct Column {
    const char* name;  // of limits.csv, where it has one
    std::string label, unit;
    Get get;
  };
  const Limit& limit = sweep_.limit();
  const Column columns[] = {
      {"limit", "largest " + PlainName(limit) + " survived", UnitOf(limit),
       [](const LimitPoint& p) { return p.search.limit(); }},
      {"impulse", "impulse", "N·s", impulse(false)},
      {"impulse_per_mass", "impulse over the robot's mass", "N·s/kg", impulse(true)},
      {"share_of_lip", "share of the pendulum's impulse m w d", "", share(&PushBound::lip_impulse)},
      {"share_of_lip_of_duration", "share of the pendulum's impulse for the push's duration", "",
       share(&PushBound::lip_impulse_of_duration)},
      {"share_of_step", "share of what one step catches", "", share(&PushBound::step_impulse)}};
  const std::vector<LimitPoint> points = LimitPoints(header_, rows_);
  // The limit is drawn over one number, an angle if there is one; the others tell marks apart.
  std::optional<int> along;
  for (int i = 0; i < count(); ++i) {
    if (variable(i).choice_size() > 0) continue;
    if (!along || (variable(i).angle() && !variable(*along).angle())) along = i;
  }
  Json values = Json::array(), maps = Json::array(), rows = Json::array();
  for (const LimitPoint& point : points) {
    const std::optional<double> at = point.search.limit(), fails = point.search.fails_at();
    const bool known = point.search.known();
    std::string told = !known  ? "not known: a run does not tell"
                       : !at   ? "not even the smallest that was tried is survived"
                       : fails ? "fails at " + FormatNumber(*fails, UnitOf(limit))
                               : "at least: nothing that was tried fails";
    if (point.search.survived_again()) told += ", something beyond is survived again";
    told += fmt::format("; {} run{}", point.search.tried(), point.search.tried() == 1 ? "" : "s");
    rows.push_back(RowJson(*point.any, !known ? "unknown" : at ? kStands : kFell, told));
  }
  for (const Column& column : columns) {
    const auto has = [&](const LimitPoint& point) { return column.get(point).has_value(); };
    if (&column != columns && std::ranges::none_of(points, has)) continue;
    if (along) maps.push_back({{"x", *along}, {"value", values.size()}});
    values.push_back({{"name", column.name}, {"label", column.label}, {"unit", column.unit}});
    for (size_t i = 0; i < points.size(); ++i) {
      rows[i]["values"].push_back(OrNull(column.get(points[i])));
    }
  }
  (*part)["values"] = std::move(values);
  (*part)["maps"] = std::move(maps);
  (*part)["rows"] = std::move(rows);
}

}  // namespace

Json SweepChartsPart(const SweepHeader& header, const SweepRows& rows, const std::string& what,
                     const fs::path& folder) {
  const bool limit = header.sweep.has_limit() && header.sweep.vary_size() > 0;
  const Part data(header, rows, folder);
  Json part = {{"name", header.sweep.name()},
               {"kind", limit ? "limit" : "sweep"},
               {"sentences", SurvivalSentences(header, rows)},
               {"command", CommandOf(header.sweep, what)},
               {"variables", data.Variables()}};
  if (limit) {
    data.AddLimits(&part);
  } else {
    data.AddSweep(&part);
  }
  return part;
}

Json SweepCharts(const SweepHeader& header, const SweepRows& rows, const fs::path& folder) {
  std::string text = FormatOutcomes(header, rows);
  if (header.sweep.has_limit()) text += "\n" + FormatLimits(header, rows);
  return {{"format", kChartsFormat},
          {"title", header.sweep.name()},
          {"description", header.sweep.description()},
          {"text", WithoutTones(text)},
          {"parts", Json::array({SweepChartsPart(header, rows, "", folder)})}};
}

}  // namespace poise
