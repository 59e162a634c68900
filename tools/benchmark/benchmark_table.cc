#include "tools/benchmark/benchmark_table.h"

#include <algorithm>
#include <boost/uuid/detail/sha1.hpp>

#include "fmt/format.h"
#include "tools/cli/text_table.h"
#include "tools/sweep/sweep_points.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

constexpr char kAtLeast[] = "at least";
constexpr char kBelow[] = "below";

using Pick = std::optional<double> BenchmarkFigure::*;
constexpr Pick kPicks[] = {&BenchmarkFigure::value, &BenchmarkFigure::impulse,
                           &BenchmarkFigure::per_mass, &BenchmarkFigure::of_pendulum,
                           &BenchmarkFigure::of_duration};

/// `pick` of all figures; empty where one does not have it.
std::vector<double> AllOf(const std::vector<BenchmarkFigure>& figures, Pick pick) {
  std::vector<double> values;
  for (const BenchmarkFigure& figure : figures) {
    if (!(figure.*pick)) return {};
    values.push_back(*(figure.*pick));
  }
  return values;
}

BenchmarkFigure MeanOf(const std::vector<BenchmarkFigure>& points) {
  BenchmarkFigure mean{"mean", points[0].unit};
  for (const BenchmarkFigure& point : points) {
    if (point.bound.empty() || point.bound == mean.bound) continue;
    if (!mean.bound.empty()) return {"mean", points[0].unit};  // some above, some below
    mean.bound = point.bound;
  }
  for (const Pick pick : kPicks) {
    const std::vector<double> values = AllOf(points, pick);
    if (values.empty()) continue;
    double sum = 0;
    for (const double value : values) sum += value;
    mean.*pick = sum / static_cast<double>(values.size());
  }
  return mean;
}

BenchmarkFigure LeastOf(const std::vector<BenchmarkFigure>& points) {
  BenchmarkFigure least{"least", points[0].unit};
  for (const Pick pick : kPicks) {
    const std::vector<double> values = AllOf(points, pick);
    if (!values.empty()) least.*pick = *std::ranges::min_element(values);
  }
  // The bound is that of the smallest value; of equal ones the one that says most.
  const auto rank = [](const std::string& bound) {
    return bound == kBelow ? 0 : bound.empty() ? 1 : 2;
  };
  int best = 3;
  for (const BenchmarkFigure& point : points) {
    if (point.value != least.value || rank(point.bound) >= best) continue;
    best = rank(point.bound);
    least.bound = point.bound;
  }
  return least;
}

/// Where a run lies, without the value of a limit.
std::string PlaceOf(const SweepPoints& points, int64_t run) {
  SweepRow row;
  row.run = run;
  return PlaceText(points, row);
}

/// A part's points, and below them their mean and the least.
std::vector<BenchmarkFigure> OfLimits(const BenchmarkResult& result) {
  const SweepPoints points(result.header.sweep);
  const Limit& limit = result.header.sweep.limit();
  std::vector<BenchmarkFigure> figures;
  // The push is what is measured; else it only disturbs.
  const bool push = limit.field().starts_with("sim.push");
  for (const LimitPoint& point : LimitPoints(result.header, result.rows)) {
    BenchmarkFigure figure{PlaceOf(points, point.run), limit.unit()};
    const SweepRow* const row = point.at_limit != nullptr ? point.at_limit : point.at_fall;
    if (row != nullptr) {
      figure.value = row->limit;
      figure.bound = point.at_limit == nullptr ? kBelow : point.at_fall == nullptr ? kAtLeast : "";
    }
    if (push && row != nullptr && row->push) {
      figure.impulse = row->push->impulse;
      figure.per_mass = row->push->impulse / row->push->mass;
      if (row->push->bounded()) {
        figure.of_pendulum = row->push->impulse / row->push->lip_impulse;
        figure.of_duration = row->push->impulse / row->push->lip_impulse_of_duration;
      }
    }
    figures.push_back(figure);
  }
  if (figures.empty()) return figures;
  const std::vector<BenchmarkFigure> sums = {MeanOf(figures), LeastOf(figures)};
  figures.insert(figures.end(), sums.begin(), sums.end());
  return figures;
}

/// How many of a part's runs stand.
std::vector<BenchmarkFigure> OfRuns(const BenchmarkResult& result) {
  int64_t told = 0, stand = 0;
  for (const auto& [key, row] : result.rows) {
    told += row.survived() ? 1 : 0;
    stand += row.stands() ? 1 : 0;
  }
  BenchmarkFigure figure{fmt::format("stand, of {}", told), "runs"};
  if (told > 0) figure.value = static_cast<double>(stand);
  return {figure};
}

template <class Format>
std::string Known(const std::optional<double>& value, const Format& format) {
  return value ? format(*value) : std::string("–");
}

std::string Percent(const std::optional<double>& share) {
  return Known(share, [](double v) { return fmt::format("{:.1f} %", 100 * v); });
}

}  // namespace

std::vector<BenchmarkFigure> BenchmarkFigures(const BenchmarkResult& result) {
  if (result.rows.empty()) return {};
  std::vector<BenchmarkFigure> figures =
      result.header.sweep.has_limit() ? OfLimits(result) : OfRuns(result);
  const SweepPoints points(result.header.sweep);
  for (const auto& [key, row] : result.rows) {
    if (row.survived()) continue;
    figures.push_back({fmt::format("run {}: {}", row.run, PlaceText(points, row)), ""});
    figures.back().untold = &row;
  }
  return figures;
}

std::string BenchmarkCsv(const std::vector<BenchmarkResult>& results) {
  std::string csv =
      "part,point,value,unit,bound,impulse,impulse_per_mass,share_of_lip,"
      "share_of_lip_of_duration,outcome,component,stage,reason\n";
  for (const BenchmarkResult& result : results) {
    for (const BenchmarkFigure& f : BenchmarkFigures(result)) {
      const SweepRow none;
      const SweepRow& run = f.untold != nullptr ? *f.untold : none;
      csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", result.part.name(),
                         CsvCell(f.point), CsvNumber(f.value), CsvCell(f.unit), f.bound,
                         CsvNumber(f.impulse), CsvNumber(f.per_mass), CsvNumber(f.of_pendulum),
                         CsvNumber(f.of_duration), run.outcome, CsvCell(run.component),
                         CsvCell(run.stage), CsvCell(run.reason));
    }
  }
  return csv;
}

std::string FormatBenchmark(const std::vector<BenchmarkResult>& results) {
  std::string text;
  for (const BenchmarkResult& result : results) {
    const std::vector<BenchmarkFigure> figures = BenchmarkFigures(result);
    if (figures.empty()) continue;
    text += fmt::format("{}{}: {}\n\n", text.empty() ? "" : "\n", result.part.name(),
                        result.part.title());
    const bool push = std::ranges::any_of(
        figures, [](const BenchmarkFigure& figure) { return figure.impulse.has_value(); });
    std::vector<TableRow> rows = {{"", figures[0].unit}};
    if (push) {
      rows[0].insert(rows[0].end(), {"N·s", "N·s/kg", "of the bound", "for the duration"});
    }
    for (const BenchmarkFigure& f : figures) {
      if (f.untold != nullptr) continue;
      const std::string bound = f.bound.empty() ? "" : f.bound + " ";
      rows.push_back(
          {f.point, f.value ? bound + FormatNumber(*f.value) : std::string("not known")});
      if (!push) continue;
      rows.back().insert(rows.back().end(),
                         {Known(f.impulse, [](double v) { return fmt::format("{:.2f}", v); }),
                          Known(f.per_mass, [](double v) { return fmt::format("{:.3f}", v); }),
                          Percent(f.of_pendulum), Percent(f.of_duration)});
    }
    text += FormatColumns(rows);
    for (const std::string& runs :
         {FormatMissed(result.header, result.rows), FormatUntold(result.header, result.rows)}) {
      if (!runs.empty()) text += "\n" + runs;
    }
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
