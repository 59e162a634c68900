#include "deploy/poise/sweep_maps.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "deploy/poise/sweep_charts.h"
#include "deploy/poise/sweep_points.h"
#include "deploy/poise/sweep_table.h"
#include "fmt/format.h"
#include "logging/metrics.h"

namespace poise {
namespace {

constexpr char kStandsValue[] = "stands";

/// What the charts need of the rows.
class Maps {
 public:
  Maps(const SweepHeader& header, const SweepRows& rows)
      : header_(header), sweep_(header.sweep), rows_(rows), points_(sweep_) {}

  std::vector<std::string> OfSweep() const;
  std::vector<std::string> OfLimits() const;

 private:
  const Variable& variable(size_t i) const { return sweep_.vary(static_cast<int>(i)); }
  size_t count() const { return static_cast<size_t>(sweep_.vary_size()); }
  size_t Find(const std::string& name) const;
  std::string Label(size_t i) const;
  static std::string Unit(const std::string& name, const std::string& unit) {
    return unit.empty() ? name : fmt::format("{} [{}]", name, unit);
  }
  std::string ValueLabel(const std::string& value) const;
  std::optional<double> Value(const SweepRow& row, const std::string& value) const;
  std::string Tip(const SweepRow& row, const std::string& value) const;
  std::string Curve(size_t x, const std::string& value) const;
  std::string Pair(size_t x, size_t y, const std::string& value) const;
  std::string Scatter(size_t x, size_t y, const std::string& value) const;
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
};

size_t Maps::Find(const std::string& name) const {
  size_t i = 0;
  while (i < count() && NameOf(variable(i)) != name) ++i;
  return i;
}

std::string Maps::Label(size_t i) const {
  const Variable& v = variable(i);
  return Unit(NameOf(v), v.angle() && !v.has_unit() ? "°" : v.unit());
}

std::string Maps::ValueLabel(const std::string& value) const {
  if (value == kStandsValue) return "share that stands";
  const logging::Metric* metric = logging::FindMetric(value);
  return Unit(value, metric == nullptr ? "" : metric->unit);
}

std::optional<double> Maps::Value(const SweepRow& row, const std::string& value) const {
  if (value == kStandsValue) return row.stands() ? 1 : 0;
  const auto metric = row.metrics.find(value);
  if (metric == row.metrics.end()) return {};
  return metric->second;
}

std::string Maps::Tip(const SweepRow& row, const std::string& value) const {
  std::string tip = fmt::format("run {}", row.run);
  const std::vector<SweepValue> point = points_.At(row.run);
  for (size_t i = 0; i < point.size(); ++i) {
    tip += fmt::format("\n{}: {}", Label(i), points_.Text(i, point[i]));
  }
  tip += "\n" + row.outcome;
  if (row.fell_at) tip += fmt::format(" at {} s", *row.fell_at);
  if (!row.phase.empty()) tip += fmt::format(", phase {}", row.phase);
  if (!row.trouble.empty()) tip += ", " + row.trouble;
  if (value != kStandsValue && Value(row, value)) {
    tip += fmt::format("\n{}: {}", ValueLabel(value), *Value(row, value));
  }
  return tip;
}

Maps::Levels Maps::LevelsOf(size_t i) const {
  std::map<double, std::string> levels;
  for (const auto& [key, row] : rows_) {
    const SweepValue value = points_.At(row.run)[i];
    levels[value.number] = points_.Text(i, value);
  }
  Levels result;
  for (auto& [number, text] : levels) {
    result.numbers.push_back(number);
    result.texts.push_back(std::move(text));
  }
  return result;
}

/// Means by place.
class Means {
 public:
  void Add(std::pair<size_t, size_t> place, const std::optional<double>& value,
           const std::string& tip) {
    Entry& entry = entries_[place];
    ++entry.runs;
    entry.tip = tip;
    if (!value) return;
    entry.sum += *value;
    ++entry.values;
  }
  std::vector<ChartCell> Cells() const {
    std::vector<ChartCell> cells;
    for (const auto& [place, entry] : entries_) {
      ChartCell cell{static_cast<double>(place.first), static_cast<double>(place.second), {}, ""};
      if (entry.values > 0) cell.value = entry.sum / entry.values;
      cell.tip = entry.runs == 1
                     ? entry.tip
                     : fmt::format("{} runs, mean {}", entry.runs,
                                   cell.value ? fmt::format("{:.4g}", *cell.value) : "unknown");
      cells.push_back(std::move(cell));
    }
    return cells;
  }

 private:
  struct Entry {
    int runs = 0, values = 0;
    double sum = 0;
    std::string tip;
  };
  std::map<std::pair<size_t, size_t>, Entry> entries_;
};

std::string Maps::Curve(size_t x, const std::string& value) const {
  const ChartLabels labels{ValueLabel(value), Label(x), ValueLabel(value), ValueLabel(value)};
  if (Drawn(x)) {
    std::vector<ChartCell> cells;
    for (const auto& [key, row] : rows_) {
      const std::optional<double> y = Value(row, value);
      if (!y) continue;
      cells.push_back(
          {points_.At(row.run)[x].number, *y, row.stands() ? 1.0 : 0.0, Tip(row, value)});
    }
    ChartLabels scatter = labels;
    scatter.value = ValueLabel(kStandsValue);
    return ScatterChart(scatter, cells, ScaleOf(cells, true));
  }
  const Levels levels = LevelsOf(x);
  Means means;
  for (const auto& [key, row] : rows_) {
    means.Add({levels.Index(points_.At(row.run)[x].number), 0}, Value(row, value), Tip(row, value));
  }
  const std::vector<ChartCell> cells = means.Cells();
  if (variable(x).choice_size() > 0) {
    return HeatMap({labels.title, labels.x, "", labels.value}, levels.texts, {""}, cells,
                   ScaleOf(cells, value == kStandsValue));
  }
  ChartSeries series;
  for (const ChartCell& cell : cells) {
    if (!cell.value) continue;
    series.points.emplace_back(levels.numbers[static_cast<size_t>(cell.x)], *cell.value);
  }
  return variable(x).angle() ? PolarChart(labels, {series}) : CurveChart(labels, {series});
}

std::string Maps::Scatter(size_t x, size_t y, const std::string& value) const {
  std::vector<ChartCell> cells;
  for (const auto& [key, row] : rows_) {
    const std::vector<SweepValue> point = points_.At(row.run);
    cells.push_back({point[x].number, point[y].number, Value(row, value), Tip(row, value)});
  }
  return ScatterChart({ValueLabel(value), Label(x), Label(y), ValueLabel(value)}, cells,
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
              Tip(row, value));
  }
  std::vector<ChartCell> cells = means.Cells();
  const ChartLabels labels{ValueLabel(value), Label(x), Label(y), ValueLabel(value)};
  const ChartScale scale = ScaleOf(cells, value == kStandsValue);
  if (!variable(x).angle()) return HeatMap(labels, columns.texts, rows.texts, cells, scale);
  for (ChartCell& cell : cells) cell.x = columns.numbers[static_cast<size_t>(cell.x)];
  return PolarHeatMap(labels, columns.numbers, rows.texts, cells, scale);
}

std::vector<std::string> Maps::OfSweep() const {
  std::vector<std::string> charts;
  for (const SweepMap& map : sweep_.map()) {
    const size_t x = Find(map.x());
    charts.push_back(map.has_y() ? Pair(x, Find(map.y()), map.value()) : Curve(x, map.value()));
  }
  if (!charts.empty()) return charts;
  if (count() == 1) {
    charts.push_back(Curve(0, kStandsValue));
    for (const std::string& column : header_.columns) charts.push_back(Curve(0, column));
  }
  for (size_t y = 0; y < count(); ++y) {
    for (size_t x = 0; x < y; ++x) charts.push_back(Pair(x, y, kStandsValue));
  }
  return charts;
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
    if (p.at_limit == nullptr || !p.at_limit->push) return {};
    return p.at_limit->push->impulse / (*p.at_limit->push).*of;
  };
  static const auto share = bound_share;
  const std::vector<std::pair<std::string, Get>> values = {
      {Unit(NameOf(sweep_.limit()), sweep_.limit().unit()),
       [](const LimitPoint& p) { return p.search.limit(); }},
      {"impulse [N·s]",
       [](const LimitPoint& p) -> std::optional<double> {
         if (p.at_limit == nullptr || !p.at_limit->push) return {};
         return p.at_limit->push->impulse;
       }},
      {"share of the pendulum's impulse m w d",
       [](const LimitPoint& p) { return share(p, &PushBound::lip_impulse); }},
      {"share of the pendulum's impulse for the push's duration",
       [](const LimitPoint& p) { return share(p, &PushBound::lip_impulse_of_duration); }}};
  const std::vector<LimitPoint> points = LimitPoints(header_, rows_);
  std::vector<std::string> charts;
  for (const auto& [label, get] : values) {
    std::map<std::vector<double>, ChartSeries> series;  // by the other variables
    for (const LimitPoint& point : points) {
      const std::optional<double> value = get(point);
      if (!value) continue;
      const std::vector<SweepValue> place = points_.At(point.run);
      std::vector<double> others;
      std::string name;
      for (size_t i = 0; i < place.size(); ++i) {
        if (i == *along) continue;
        others.push_back(place[i].number);
        const std::string text = points_.Text(i, place[i]);
        name += (name.empty() ? "" : ", ") +
                (place[i].choice >= 0 ? text : NameOf(variable(i)) + " " + text);
      }
      ChartSeries& one = series[others];
      one.name = name;
      one.points.emplace_back(place[*along].number, *value);
    }
    if (series.empty()) continue;
    std::vector<ChartSeries> all;
    for (auto& [others, one] : series) all.push_back(std::move(one));
    const ChartLabels labels{label, Label(*along), label, label};
    charts.push_back(variable(*along).angle() ? PolarChart(labels, all) : CurveChart(labels, all));
  }
  return charts;
}

}  // namespace

std::vector<std::string> MapCharts(const SweepHeader& header, const SweepRows& rows) {
  const Maps maps(header, rows);
  return header.sweep.has_limit() ? maps.OfLimits() : maps.OfSweep();
}

std::string MapsPage(const SweepHeader& header, const SweepRows& rows,
                     const std::vector<std::string>& charts) {
  const Sweep& sweep = header.sweep;
  std::vector<std::string> paragraphs;
  if (sweep.has_description()) {
    paragraphs.push_back("<p>" + HtmlText(sweep.description()) + "</p>");
  }
  paragraphs.push_back("<pre>" + HtmlText(FormatOutcomes(header, rows)) + "</pre>");
  if (sweep.has_limit()) {
    paragraphs.push_back("<pre>" + HtmlText(FormatLimits(header, rows)) + "</pre>");
  }
  return ChartPage(sweep.name(), paragraphs, charts);
}

}  // namespace poise
