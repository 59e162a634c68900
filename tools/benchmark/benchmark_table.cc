#include "tools/benchmark/benchmark_table.h"

#include <algorithm>
#include <boost/uuid/detail/sha1.hpp>

#include "fmt/format.h"
#include "tools/cli/text_table.h"
#include "tools/sweep/sweep_points.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

/// A line of the results. Empty cells: not known, or not of this part.
struct Figure {
  std::string part, point, unit;
  std::optional<double> value = {};
  bool at_least = false;  // all that was tried was survived
  std::optional<double> impulse = {}, per_mass = {}, of_pendulum = {}, of_duration = {};
};

std::string PlaceText(const SweepPoints& points, int64_t run) {
  std::string text;
  const std::vector<SweepValue> values = points.At(run);
  for (size_t i = 0; i < values.size(); ++i) {
    const Variable& variable = points.sweep().vary(static_cast<int>(i));
    text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", NameOf(variable),
                        points.Text(i, values[i]), variable.angle() ? "°" : "");
  }
  return text;
}

/// `pick` of those of `figures` that have it, as `sum` makes it.
template <class Sum>
std::optional<double> Of(const std::vector<Figure>& figures, std::optional<double> Figure::*pick,
                         const Sum& sum) {
  std::vector<double> values;
  for (const Figure& figure : figures) {
    if (figure.*pick) values.push_back(*(figure.*pick));
  }
  if (values.empty() || values.size() < figures.size()) return {};
  return sum(values);
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double Least(const std::vector<double>& values) {
  return *std::min_element(values.begin(), values.end());
}

/// A part's points, and below them their mean and the least.
std::vector<Figure> OfLimits(const BenchmarkResult& result) {
  const SweepPoints points(result.header.sweep);
  std::vector<Figure> figures;
  // The push is what is measured; else it only disturbs.
  const bool push = result.header.sweep.limit().field().starts_with("sim.push");
  for (const LimitPoint& point : LimitPoints(result.header, result.rows)) {
    Figure figure{result.part.name(), PlaceText(points, point.run),
                  result.header.sweep.limit().unit()};
    // Not even the smallest one: nothing was survived.
    figure.value = point.search.limit().value_or(0);
    figure.at_least = !point.search.fails_at();
    if (push) {
      const bool known = point.at_limit != nullptr && point.at_limit->push;
      const PushBound bound = known ? *point.at_limit->push : PushBound();
      figure.impulse = bound.impulse;
      figure.per_mass = known ? bound.impulse / bound.mass : 0;
      figure.of_pendulum = known ? bound.impulse / bound.lip_impulse : 0;
      figure.of_duration = known ? bound.impulse / bound.lip_impulse_of_duration : 0;
    }
    figures.push_back(figure);
  }
  if (figures.empty()) return figures;
  const std::vector<Figure> each = figures;
  const bool at_least =
      std::any_of(each.begin(), each.end(), [](const Figure& f) { return f.at_least; });
  for (const auto& [name, sum] : {std::pair{"mean", &Mean}, std::pair{"least", &Least}}) {
    Figure figure{result.part.name(), name, each[0].unit};
    for (const auto pick : {&Figure::value, &Figure::impulse, &Figure::per_mass,
                            &Figure::of_pendulum, &Figure::of_duration}) {
      figure.*pick = Of(each, pick, sum);
    }
    figure.at_least = at_least;
    figures.push_back(figure);
  }
  return figures;
}

/// How many of a part's runs stand.
std::vector<Figure> OfRuns(const BenchmarkResult& result) {
  if (result.rows.empty()) return {};
  const auto stand = std::count_if(result.rows.begin(), result.rows.end(),
                                   [](const auto& row) { return row.second.stands(); });
  Figure figure{result.part.name(), fmt::format("stand, of {}", result.rows.size()), "runs"};
  figure.value = static_cast<double>(stand);
  return {figure};
}

std::vector<Figure> FiguresOf(const BenchmarkResult& result) {
  return result.header.sweep.has_limit() ? OfLimits(result) : OfRuns(result);
}

std::string Cell(const std::optional<double>& value) {
  return value ? fmt::format("{}", *value) : "";
}

std::string Percent(const std::optional<double>& share) {
  return share ? fmt::format("{:.1f} %", 100 * *share) : "";
}

}  // namespace

std::string BenchmarkCsv(const std::vector<BenchmarkResult>& results) {
  std::string csv =
      "part,point,value,unit,at_least,impulse,impulse_per_mass,share_of_lip,"
      "share_of_lip_of_duration\n";
  for (const BenchmarkResult& result : results) {
    for (const Figure& f : FiguresOf(result)) {
      csv += fmt::format("{},{},{},{},{},{},{},{},{}\n", f.part, CsvCell(f.point), Cell(f.value),
                         CsvCell(f.unit), f.at_least ? 1 : 0, Cell(f.impulse), Cell(f.per_mass),
                         Cell(f.of_pendulum), Cell(f.of_duration));
    }
  }
  return csv;
}

std::string FormatBenchmark(const std::vector<BenchmarkResult>& results) {
  std::string text;
  for (const BenchmarkResult& result : results) {
    const std::vector<Figure> figures = FiguresOf(result);
    if (figures.empty()) continue;
    text += fmt::format("{}{}: {}\n\n", text.empty() ? "" : "\n", result.part.name(),
                        result.part.title());
    const bool push = figures[0].impulse.has_value();
    std::vector<TableRow> rows = {{"", figures[0].unit}};
    if (push) {
      rows[0].insert(rows[0].end(), {"N·s", "N·s/kg", "of the bound", "for the duration"});
    }
    for (const Figure& f : figures) {
      const char* const least = f.at_least ? "at least " : "";
      rows.push_back({f.point, f.value ? least + FormatNumber(*f.value) : ""});
      if (!push) continue;
      rows.back().insert(rows.back().end(), {f.impulse ? fmt::format("{:.2f}", *f.impulse) : "",
                                             f.per_mass ? fmt::format("{:.3f}", *f.per_mass) : "",
                                             Percent(f.of_pendulum), Percent(f.of_duration)});
    }
    text += FormatColumns(rows);
  }
  return text;
}

std::string Sha1(const std::string& text) {
  boost::uuids::detail::sha1 hash;
  hash.process_bytes(text.data(), text.size());
  unsigned int digest[5];
  hash.get_digest(digest);
  std::string hex;
  for (const unsigned int word : digest) hex += fmt::format("{:08x}", word);
  return hex;
}

}  // namespace poise
