#include "tools/maps/sweep_maps.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/shell_word.h"
#include "tools/cli/text_table.h"
#include "tools/maps/sweep_charts.h"
#include "tools/maps/sweep_edge.h"
#include "tools/maps/sweep_labels.h"
#include "tools/maps/sweep_page.h"
#include "tools/scenario/catalog.h"
#include "tools/sweep/sweep_points.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr char kStandsValue[] = "stands";

std::string Capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// What the charts need of the rows.
class Maps {
 public:
  Maps(const SweepHeader& header, const SweepRows& rows, const std::string& what)
      : header_(header),
        sweep_(header.sweep),
        rows_(rows),
        points_(sweep_),
        command_(CommandOf(sweep_, what)) {}

  SweepMaps OfSweep() const;
  std::vector<std::string> OfLimits() const;

 private:
  const Variable& variable(size_t i) const { return sweep_.vary(static_cast<int>(i)); }
  size_t count() const { return static_cast<size_t>(sweep_.vary_size()); }
  size_t Find(const std::string& name) const;
  std::string Label(size_t i) const {
    return WithUnit(PlainName(variable(i)), UnitOf(variable(i)));
  }
  std::string ValueText(size_t i, const SweepValue& value) const {
    return value.choice >= 0 ? points_.Text(i, value) : FormatNumber(value.number);
  }
  std::optional<double> Value(const SweepRow& row, const std::string& value) const;
  /// Its value says what happened after it fell: no part of a scale.
  static bool OffScale(const SweepRow& row, const std::string& value) {
    return value != kStandsValue && row.fell();
  }
  /// "poise run ..." of all that its runs have in common.
  static std::string CommandOf(const Sweep& sweep, const std::string& what);
  /// The command that makes the run again.
  std::string Command(const SweepRow& row) const;
  std::string Tip(const SweepRow& row, const std::string& value) const;
  ChartLabels Labels(const std::string& value, const std::string& x, const std::string& y) const;
  std::string Curve(size_t x, const std::string& value) const;
  std::string Pair(size_t x, size_t y, const std::string& value) const;
  std::string Scatter(size_t x, size_t y, const std::string& value) const;
  std::string ConstantSentence(const std::string& value) const;
  bool Drawn(size_t i) const {
    return sweep_.has_random() && variable(i).choice_size() == 0 && variable(i).value_size() == 0;
  }
  /// Index of a value among those of its variable that the rows have, and their texts.
  struct Levels {
    std::vector<double> numbers;
    std::vector<std::string> texts;
    size_t Index(double number) const {
      return static_cast<size_t>(std::lower_bound(numbers.begin(), numbers.end(), number) -
                                 numbers.begin());
    }
  };
  Levels LevelsOf(size_t variable) const;

  const SweepHeader& header_;
  const Sweep& sweep_;
  const SweepRows& rows_;
  SweepPoints points_;
  std::string command_;
};

std::string Maps::CommandOf(const Sweep& sweep, const std::string& what) {
  std::string command = "poise run ";
  if (!what.empty()) {
    command += what;
  } else {
    // Its name, where that leads to the same file.
    std::string scenario = sweep.scenario();
    const std::string name = fs::path(scenario).stem().string();
    try {
      if (FindFile("scenarios", name, fs::current_path()) == fs::path(scenario)) scenario = name;
    } catch (const ConfigError&) {
      // Then the file itself is named.
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

std::string Maps::Command(const SweepRow& row) const {
  std::string command = command_;
  try {
    for (const std::string& set : points_.Changes(row.run, row.limit)) {
      command += " --set " + ShellWord(set);
    }
  } catch (const ConfigError&) {
    return "";  // an expression without a value: the run is invalid
  }
  return command;
}

size_t Maps::Find(const std::string& name) const {
  size_t i = 0;
  while (i < count() && NameOf(variable(i)) != name) ++i;
  return i;
}

std::optional<double> Maps::Value(const SweepRow& row, const std::string& value) const {
  if (!row.survived()) return {};
  if (value == kStandsValue) return row.stands() ? 1 : 0;
  const auto metric = row.metrics.find(value);
  if (metric == row.metrics.end()) return {};
  return metric->second;
}

std::string Maps::Tip(const SweepRow& row, const std::string& value) const {
  std::string tip = fmt::format("run {}", row.run);
  const std::vector<SweepValue> point = points_.At(row.run);
  for (size_t i = 0; i < point.size(); ++i) {
    tip += fmt::format("\n{}: {}", Label(i), ValueText(i, point[i]));
  }
  tip += "\n" + (row.stands() || row.fell() ? row.outcome : row.Ending());
  if (row.fell_at) tip += fmt::format(" at {} s", FormatNumber(*row.fell_at));
  if (!row.phase.empty()) tip += fmt::format(", phase {}", row.phase);
  if (!row.trouble.empty()) tip += ", " + row.trouble;
  if (value != kStandsValue && Value(row, value)) {
    tip += fmt::format("\n{}: {}", MetricLabel(value),
                       FormatNumber(*Value(row, value), MetricUnit(value)));
  }
  const std::string command = Command(row);
  return command.empty() ? tip : tip + "\n" + command;
}

/// Labels of a map of `value`; an empty `y`: the value itself is the vertical axis.
ChartLabels Maps::Labels(const std::string& value, const std::string& x,
                         const std::string& y) const {
  if (value == kStandsValue) {
    return {"What stands", x, y.empty() ? "share of the runs that stand" : y, "", y.empty()};
  }
  const std::string unit = MetricUnit(value);
  return {Capital(MetricLabel(value)), x, y.empty() ? unit : y, unit};
}

Maps::Levels Maps::LevelsOf(size_t i) const {
  std::map<double, std::string> levels;
  for (const auto& [key, row] : rows_) {
    const SweepValue value = points_.At(row.run)[i];
    levels[value.number] = ValueText(i, value);
  }
  Levels result;
  for (auto& [number, text] : levels) {
    result.numbers.push_back(number);
    result.texts.push_back(std::move(text));
  }
  return result;
}

/// Means by place, of the runs that are on the scale.
class Means {
 public:
  void Add(std::pair<size_t, size_t> place, const std::optional<double>& value, bool off_scale,
           bool untold, const std::string& tip) {
    Entry& entry = entries_[place];
    ++entry.runs;
    entry.tip = tip;
    entry.off += off_scale ? 1 : 0;
    entry.untold += untold ? 1 : 0;
    if (!value || off_scale) return;
    entry.sum += *value;
    ++entry.values;
  }
  std::vector<ChartCell> Cells() const {
    std::vector<ChartCell> cells;
    for (const auto& [place, entry] : entries_) {
      const int told = entry.runs - entry.untold;
      ChartCell cell{static_cast<double>(place.first), static_cast<double>(place.second), {}, ""};
      cell.untold = told == 0;
      cell.fallen = told > 0 && entry.off == told;
      cell.some_fallen = entry.off > 0 && entry.off < told;
      if (entry.values > 0) cell.value = entry.sum / entry.values;
      cell.tip = entry.runs == 1 ? entry.tip : Text(entry, cell.value);
      cells.push_back(std::move(cell));
    }
    return cells;
  }

 private:
  struct Entry {
    int runs = 0, values = 0, off = 0, untold = 0;
    double sum = 0;
    std::string tip;
  };
  static std::string Text(const Entry& entry, const std::optional<double>& mean) {
    std::string text = fmt::format("{} runs", entry.runs);
    if (entry.off > 0) text += fmt::format(", of which {} did not stand", entry.off);
    if (entry.untold > 0) text += fmt::format(", {} do not tell", entry.untold);
    return text + fmt::format("\nmean: {}", mean ? FormatNumber(*mean) : "none");
  }
  std::map<std::pair<size_t, size_t>, Entry> entries_;
};

std::string Maps::Curve(size_t x, const std::string& value) const {
  const ChartLabels labels = Labels(value, Label(x), "");
  // A run stands or falls: a line between the two would tell of runs that are neither.
  const bool either = value == kStandsValue && !variable(x).angle();
  if (Drawn(x) || (either && variable(x).choice_size() == 0)) {
    std::vector<ChartPoint> points;
    for (const auto& [key, row] : rows_) {
      points.push_back({points_.At(row.run)[x].number, Value(row, value), Tip(row, value),
                        OffScale(row, value), !row.survived()});
    }
    return PointChart(labels, points);
  }
  const Levels levels = LevelsOf(x);
  Means means;
  for (const auto& [key, row] : rows_) {
    means.Add({levels.Index(points_.At(row.run)[x].number), 0}, Value(row, value),
              OffScale(row, value), !row.survived(), Tip(row, value));
  }
  const std::vector<ChartCell> cells = means.Cells();
  if (variable(x).choice_size() > 0) {
    return HeatMap({labels.title, labels.x, "", labels.unit}, levels.texts, {""}, cells,
                   ScaleOf(cells, value == kStandsValue));
  }
  ChartSeries series;
  for (const ChartCell& cell : cells) {
    series.points.push_back({levels.numbers[static_cast<size_t>(cell.x)], cell.value, cell.tip,
                             cell.fallen, cell.untold});
  }
  return variable(x).angle() ? PolarChart(labels, {series}) : CurveChart(labels, {series});
}

std::string Maps::Scatter(size_t x, size_t y, const std::string& value) const {
  std::vector<ChartCell> cells;
  for (const auto& [key, row] : rows_) {
    const std::vector<SweepValue> point = points_.At(row.run);
    cells.push_back({point[x].number, point[y].number, Value(row, value), Tip(row, value),
                     OffScale(row, value), false, !row.survived()});
  }
  return ScatterChart(Labels(value, Label(x), Label(y)), cells,
                      ScaleOf(cells, value == kStandsValue));
}

std::string Maps::Pair(size_t x, size_t y, const std::string& value) const {
  if (Drawn(x) || Drawn(y)) return Scatter(x, y, value);
  if (variable(y).angle() && !variable(x).angle()) std::swap(x, y);
  const Levels columns = LevelsOf(x);
  const Levels rows = LevelsOf(y);
  Means means;
  for (const auto& [key, row] : rows_) {
    const std::vector<SweepValue> point = points_.At(row.run);
    means.Add({columns.Index(point[x].number), rows.Index(point[y].number)}, Value(row, value),
              OffScale(row, value), !row.survived(), Tip(row, value));
  }
  std::vector<ChartCell> cells = means.Cells();
  const ChartLabels labels = Labels(value, Label(x), Label(y));
  const ChartScale scale = ScaleOf(cells, value == kStandsValue);
  if (!variable(x).angle()) return HeatMap(labels, columns.texts, rows.texts, cells, scale);
  for (ChartCell& cell : cells) cell.x = columns.numbers[static_cast<size_t>(cell.x)];
  return PolarHeatMap(labels, columns.numbers, rows.texts, cells, scale);
}

/// Says of a metric that all runs that stand agree on it, or that none knows it; else empty.
std::string Maps::ConstantSentence(const std::string& value) const {
  std::optional<double> first;
  for (const auto& [key, row] : rows_) {
    const std::optional<double> here = row.stands() ? Value(row, value) : std::nullopt;
    if (first && here && *here != *first) return "";
    if (here) first = here;
  }
  return fmt::format("{}: {}", Capital(MetricLabel(value)),
                     first ? FormatNumber(*first, MetricUnit(value)) : "none");
}

SweepMaps Maps::OfSweep() const {
  SweepMaps maps;
  for (const SweepMap& map : sweep_.map()) {
    const size_t x = Find(map.x());
    (map.value() == kStandsValue ? maps.survival : maps.metrics)
        .push_back(map.has_y() ? Pair(x, Find(map.y()), map.value()) : Curve(x, map.value()));
  }
  if (sweep_.map_size() > 0) return maps;
  if (count() == 1) {
    // Over seeds, which have no order, a point at 0 or 1 for each tells less than the table.
    const bool seed = IsSeed(variable(0));
    if (!seed) maps.survival.push_back(Curve(0, kStandsValue));
    for (const std::string& column : header_.columns) {
      std::string constant = ConstantSentence(column);
      if (constant.empty()) {
        maps.metrics.push_back(Curve(0, column));
      } else {
        maps.constants.push_back(std::move(constant));
      }
    }
  }
  for (size_t y = 0; y < count(); ++y) {
    if (IsSeed(variable(y))) continue;
    for (size_t x = 0; x < y; ++x) {
      if (IsSeed(variable(x))) continue;
      maps.survival.push_back(Pair(x, y, kStandsValue));
    }
  }
  return maps;
}

std::vector<std::string> Maps::OfLimits() const {
  // Over one variable, an angle if there is one; the others tell curves apart.
  std::optional<size_t> along;
  for (size_t i = 0; i < count(); ++i) {
    const bool number = variable(i).choice_size() == 0;
    if (number && (!along || (variable(i).angle() && !variable(*along).angle()))) along = i;
  }
  if (!along) return {};
  using Get = std::optional<double> (*)(const LimitPoint&);
  const auto bound_share = [](const LimitPoint& p, double PushBound::*of) -> std::optional<double> {
    if (p.at_limit == nullptr || !p.at_limit->push || !p.at_limit->push->bounded()) return {};
    return p.at_limit->push->impulse / (*p.at_limit->push).*of;
  };
  static const auto share = bound_share;
  const std::vector<std::pair<std::string, Get>> values = {
      {WithUnit("largest " + PlainName(sweep_.limit()) + " survived", UnitOf(sweep_.limit())),
       [](const LimitPoint& p) { return p.search.limit(); }},
      {"impulse [N·s]",
       [](const LimitPoint& p) -> std::optional<double> {
         if (p.at_limit == nullptr || !p.at_limit->push) return {};
         return p.at_limit->push->impulse;
       }},
      {"impulse over the robot's mass [N·s/kg]",
       [](const LimitPoint& p) -> std::optional<double> {
         if (p.at_limit == nullptr || !p.at_limit->push) return {};
         return p.at_limit->push->impulse / p.at_limit->push->mass;
       }},
      {"share of the pendulum's impulse m w d",
       [](const LimitPoint& p) { return share(p, &PushBound::lip_impulse); }},
      {"share of the pendulum's impulse for the push's duration",
       [](const LimitPoint& p) { return share(p, &PushBound::lip_impulse_of_duration); }},
      {"share of what one step catches", [](const LimitPoint& p) -> std::optional<double> {
         if (p.at_limit == nullptr || !p.at_limit->push) return {};
         if (!(p.at_limit->push->step_time > 0)) return {};
         return share(p, &PushBound::step_impulse);
       }}};
  const std::vector<LimitPoint> points = LimitPoints(header_, rows_);
  std::vector<std::string> charts;
  for (const auto& [label, get] : values) {
    std::map<std::vector<double>, ChartSeries> series;  // by the other variables
    for (const LimitPoint& point : points) {
      const std::optional<double> value = get(point);
      // Where it is not known it is so in the first chart; the others have what they can tell.
      const bool unknown = !point.search.known() && charts.empty();
      if (!value && !unknown) continue;
      const std::vector<SweepValue> place = points_.At(point.run);
      std::vector<double> others;
      std::string name;
      for (size_t i = 0; i < place.size(); ++i) {
        if (i == *along) continue;
        others.push_back(place[i].number);
        const std::string text = ValueText(i, place[i]);
        name += (name.empty() ? "" : ", ") +
                (place[i].choice >= 0 ? text : PlainName(variable(i)) + " " + text);
      }
      ChartSeries& one = series[others];
      one.name = name;
      std::string tip = name.empty() ? "" : name + "\n";
      const bool at_least = value && !point.search.fails_at();
      tip += fmt::format("{}: {}\n{}: {}{}", Label(*along), ValueText(*along, place[*along]), label,
                         at_least ? "at least " : "", value ? FormatNumber(*value) : "not known");
      const std::string command = Command(*point.any);
      if (!command.empty()) tip += "\n" + command;
      one.points.push_back({place[*along].number, value, tip, false, unknown});
    }
    if (series.empty()) continue;
    std::vector<ChartSeries> all;
    for (auto& [others, one] : series) all.push_back(std::move(one));
    const ChartLabels labels{Capital(label), Label(*along), label, ""};
    charts.push_back(variable(*along).angle() ? PolarChart(labels, all) : CurveChart(labels, all));
  }
  return charts;
}

}  // namespace

std::vector<std::string> SweepMaps::all() const {
  std::vector<std::string> charts = survival;
  charts.insert(charts.end(), metrics.begin(), metrics.end());
  return charts;
}

SweepMaps MapCharts(const SweepHeader& header, const SweepRows& rows, const std::string& what) {
  const Maps maps(header, rows, what);
  if (!header.sweep.has_limit()) return maps.OfSweep();
  SweepMaps limits;
  limits.survival = maps.OfLimits();
  return limits;
}

std::string MapsPage(const SweepHeader& header, const SweepRows& rows, const SweepMaps& maps) {
  MapsPageContent content;
  content.title = header.sweep.name();
  content.description = header.sweep.description();
  content.edge = SurvivalSentences(header, rows);
  content.survival = maps.survival;
  content.metrics = maps.metrics;
  content.constants = maps.constants;
  content.tables.push_back(FormatOutcomes(header, rows));
  if (header.sweep.has_limit()) content.tables.push_back(FormatLimits(header, rows));
  return FormatMapsPage(content);
}

}  // namespace poise
