#include "tools/sweep/sweep_table.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <vector>

#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/lists.h"
#include "tools/cli/text_table.h"

namespace poise {
namespace {

/// The run's number and its variables.
std::vector<std::string> Place(const SweepPoints& points, int64_t run) {
  std::vector<std::string> cells = {fmt::format("{}", run)};
  const std::vector<SweepValue> values = points.At(run);
  for (size_t i = 0; i < values.size(); ++i) cells.push_back(points.Text(i, values[i]));
  return cells;
}

std::vector<std::string> PlaceNames(const Sweep& sweep) {
  std::vector<std::string> names = {"run"};
  for (const Variable& variable : sweep.vary()) names.push_back(NameOf(variable));
  return names;
}

std::string Share(double part, double whole) { return fmt::format("{}", part / whole); }

}  // namespace

std::string SweepCsv(const SweepHeader& header, const SweepRows& rows) {
  const SweepPoints points(header.sweep);
  const bool limit = header.sweep.has_limit();
  std::vector<std::string> names = PlaceNames(header.sweep);
  if (limit) names.push_back(NameOf(header.sweep.limit()));
  names.insert(names.end(), {"outcome", "fell_at", "ended_at", "phase", "trouble", "reason",
                             "component", "stage"});
  names.insert(names.end(), header.columns.begin(), header.columns.end());
  std::string csv = CsvLine(names);
  for (const auto& [key, row] : rows) {
    std::vector<std::string> cells = Place(points, row.run);
    if (limit) cells.push_back(CsvNumber(row.limit));
    // A run that does not tell when it ended leaves the cell empty.
    const bool ended = row.survived() || row.ended_at != 0;
    cells.insert(cells.end(),
                 {row.outcome, CsvNumber(row.fell_at), ended ? fmt::format("{}", row.ended_at) : "",
                  row.phase, row.trouble, row.reason, row.component, row.stage});
    for (const std::string& name : header.columns) {
      const auto metric = row.metrics.find(name);
      cells.push_back(metric == row.metrics.end() ? "" : fmt::format("{}", metric->second));
    }
    csv += CsvLine(cells);
  }
  return csv;
}

std::vector<LimitPoint> LimitPoints(const SweepHeader& header, const SweepRows& rows) {
  std::vector<LimitPoint> points;
  for (const auto& [key, row] : rows) {
    if (points.empty() || points.back().run != row.run) {
      points.push_back({row.run, LimitSearch(header.sweep.limit())});
      points.back().any = &row;
    }
    points.back().search.Add(*row.limit, row.survived());
    points.back().untold += row.survived() ? 0 : 1;
  }
  for (LimitPoint& point : points) {
    const auto row_at = [&](const std::optional<double>& value) {
      return value ? &rows.at({point.run, *value}) : nullptr;
    };
    point.at_limit = row_at(point.search.limit());
    point.at_fall = row_at(point.search.fails_at());
    point.at_largest = row_at(point.search.largest_survived());
    for (const SweepRow* const row : {point.at_fall, point.at_limit}) {
      if (row != nullptr) point.any = row;
    }
  }
  return points;
}

std::string LimitCsv(const SweepHeader& header, const SweepRows& rows) {
  const SweepPoints points(header.sweep);
  std::vector<std::string> names = PlaceNames(header.sweep);
  names.push_back(NameOf(header.sweep.limit()));
  names.insert(names.end(), {"fails_at", "largest_survived", "monotone", "runs", "untold"});
  names.insert(names.end(), {"impulse", "largest_survived_impulse", "mass", "com_height"});
  names.insert(names.end(), {"distance_to_edge", "lip_impulse", "share_of_lip"});
  names.insert(names.end(), {"lip_impulse_of_duration", "share_of_lip_of_duration", "reach"});
  names.insert(names.end(), {"step_time", "step_impulse", "share_of_step"});
  names.insert(names.end(), {"phase", "trouble", "reason"});
  std::string csv = CsvLine(names);
  for (const LimitPoint& point : LimitPoints(header, rows)) {
    std::vector<std::string> cells = Place(points, point.run);
    cells.insert(cells.end(),
                 {CsvNumber(point.search.limit()), CsvNumber(point.search.fails_at()),
                  CsvNumber(point.search.largest_survived()), CsvNumber(point.search.monotone()),
                  CsvNumber(std::optional(point.search.tried())), fmt::format("{}", point.untold)});
    const std::optional<PushBound> push = point.any->push;
    const std::optional<PushBound> bound = push && push->bounded() ? push : std::nullopt;
    const auto impulse = [](const SweepRow* row) {
      return row != nullptr && row->push ? std::optional(row->push->impulse) : std::nullopt;
    };
    const std::optional<double> at_limit = impulse(point.at_limit);
    cells.push_back(CsvNumber(at_limit));
    cells.push_back(CsvNumber(impulse(point.at_largest)));
    const auto of_bound = [&](double PushBound::*field) {
      cells.push_back(bound ? fmt::format("{}", (*bound).*field) : "");
    };
    const auto share = [&](double PushBound::*field) {
      of_bound(field);
      cells.push_back(bound && at_limit ? Share(*at_limit, (*bound).*field) : "");
    };
    cells.push_back(push ? fmt::format("{}", push->mass) : "");
    of_bound(&PushBound::height);
    of_bound(&PushBound::distance);
    share(&PushBound::lip_impulse);
    share(&PushBound::lip_impulse_of_duration);
    // The run at the limit tells: each has its own time.
    const std::optional<PushBound> stepped =
        point.at_limit != nullptr && point.at_limit->push && point.at_limit->push->step_time > 0
            ? point.at_limit->push
            : std::nullopt;
    for (const auto field : {&PushBound::reach, &PushBound::step_time, &PushBound::step_impulse}) {
      cells.push_back(stepped ? fmt::format("{}", (*stepped).*field) : "");
    }
    cells.push_back(stepped ? Share(stepped->impulse, stepped->step_impulse) : "");
    const SweepRow* const fall = point.at_fall;
    for (const auto field : {&SweepRow::phase, &SweepRow::trouble, &SweepRow::reason}) {
      cells.push_back(fall != nullptr ? fall->*field : "");
    }
    csv += CsvLine(cells);
  }
  return csv;
}

namespace {

/// What the capture point's warnings were worth, of runs with step_needed_time; else empty.
std::string FormatWarnings(const SweepRows& rows) {
  int falls = 0, standing = 0, false_alarms = 0;
  std::vector<double> warnings;  // s
  for (const auto& [key, row] : rows) {
    const auto needed = row.metrics.find("step_needed_time");
    if (needed == row.metrics.end()) continue;
    const auto warning = row.metrics.find("step_warning_time");
    if (row.outcome == kFell) {
      ++falls;
      if (warning != row.metrics.end() && warning->second > 0) warnings.push_back(warning->second);
    } else if (row.outcome == kStands) {
      ++standing;
      false_alarms += needed->second > 0 ? 1 : 0;
    }
  }
  if (falls + standing == 0) return "";
  std::string text =
      fmt::format("step_needed: {} of {} falls announced, false alarms in {} of {} that stand",
                  warnings.size(), falls, false_alarms, standing);
  if (!warnings.empty()) {
    const auto middle = warnings.begin() + static_cast<std::ptrdiff_t>(warnings.size() / 2);
    std::nth_element(warnings.begin(), middle, warnings.end());
    text += fmt::format(", median warning {:.2f} s", *middle);
  }
  text += "\n";
  return text;
}

/// "step needed, bridge state" of "step_needed+bridge_state": words, between which a cell breaks.
std::string Words(const std::string& trouble) {
  return trouble.empty() ? "-" : Joined(Split(Spaced(trouble), '+'), ", ");
}

}  // namespace

std::string FormatOutcomes(const SweepHeader& header, const SweepRows& rows) {
  std::map<std::string, int> outcomes;
  std::map<std::pair<std::string, std::string>, int> ways;
  for (const auto& [key, row] : rows) {
    ++outcomes[row.outcome];
    if (row.outcome == kFell) ++ways[{row.phase, row.trouble}];
  }
  std::string text = fmt::format("{} runs", rows.size());
  const int told = outcomes[kStands] + outcomes[kFell] + outcomes[kMissed];
  for (const char* outcome : {kStands, kFell, kMissed, kStopped, kInvalid, kCrashed, kHung}) {
    if (outcomes[outcome] == 0) continue;
    text += fmt::format(", {} {}", outcome, outcomes[outcome]);
    if (outcome == kStands || outcome == kFell || outcome == kMissed) {
      text += fmt::format(" ({:.1f} %)", 100.0 * outcomes[outcome] / told);
    }
  }
  text += "\n";
  const auto has = [&](const char* column) { return IsAmong(column, header.columns); };
  if (has("step_needed_time") && has("step_warning_time")) text += FormatWarnings(rows);
  text += FormatMissed(header, rows);
  text += FormatUntold(header, rows);
  if (ways.empty()) return text;
  std::vector<std::pair<std::pair<std::string, std::string>, int>> sorted(ways.begin(), ways.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::vector<TableRow> table = {{"fell", "in phase", "after"}};
  for (const auto& [way, count] : sorted) {
    table.push_back({fmt::format("{}", count), way.first, Words(way.second)});
  }
  return text + "\n" + FormatColumns(table);
}

std::string FormatLimits(const SweepHeader& header, const SweepRows& rows) {
  const SweepPoints points(header.sweep);
  const Limit& limit = header.sweep.limit();
  std::vector<std::string> heading = PlaceNames(header.sweep);
  const std::string unit = limit.has_unit() ? fmt::format(" [{}]", limit.unit()) : "";
  heading.push_back(NameOf(limit) + unit);
  const std::vector<LimitPoint> found = LimitPoints(header, rows);
  const bool again = std::ranges::any_of(
      found, [](const LimitPoint& point) { return point.search.survived_again(); });
  if (again) heading.emplace_back("survived again");
  const bool push = std::any_of(found.begin(), found.end(),
                                [](const LimitPoint& p) { return p.any->push.has_value(); });
  const bool bounded = std::ranges::any_of(found, [](const LimitPoint& p) {
    return p.at_limit != nullptr && p.at_limit->push && p.at_limit->push->bounded();
  });
  if (push) heading.emplace_back("N·s");
  if (bounded) heading.insert(heading.end(), {"of pendulum", "for the duration"});
  const bool step = std::any_of(found.begin(), found.end(), [](const LimitPoint& p) {
    return p.at_limit != nullptr && p.at_limit->push && p.at_limit->push->step_time > 0;
  });
  if (step) heading.emplace_back("of one step's");
  std::vector<TableRow> table = {TableRow(heading.begin(), heading.end())};
  for (const LimitPoint& point : found) {
    std::vector<std::string> cells = Place(points, point.run);
    const LimitSearch& search = point.search;
    const auto number = [](const std::optional<double>& value) {
      return value ? FormatNumber(*value) : "–";
    };
    cells.push_back(!search.known()     ? "not known"
                    : !search.limit()   ? fmt::format("below {}", number(search.fails_at()))
                    : search.fails_at() ? number(search.limit())
                                        : "at least " + number(search.limit()));
    if (again) {
      cells.push_back(search.survived_again() ? number(search.largest_survived()) : "");
    }
    const std::optional<PushBound> pushed =
        point.at_limit != nullptr ? point.at_limit->push : std::nullopt;
    const auto percent = [&](bool known, double PushBound::*of) {
      return known ? fmt::format("{:.1f} %", 100 * pushed->impulse / (*pushed).*of) : "–";
    };
    if (push) cells.push_back(pushed ? FormatNumber(pushed->impulse) : "–");
    if (bounded) {
      const bool known = pushed && pushed->bounded();
      cells.push_back(percent(known, &PushBound::lip_impulse));
      cells.push_back(percent(known, &PushBound::lip_impulse_of_duration));
    }
    if (step) {
      const bool stepped = pushed && pushed->step_time > 0;
      cells.push_back(stepped ? percent(true, &PushBound::step_impulse) : pushed ? "no step" : "–");
    }
    table.emplace_back(cells.begin(), cells.end());
  }
  return FormatColumns(table);
}

std::string PlaceText(const SweepPoints& points, const SweepRow& row) {
  std::string text;
  const auto add = [&](const std::string& name, const std::string& value) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name, value);
  };
  const std::vector<SweepValue> values = points.At(row.run);
  for (size_t i = 0; i < values.size(); ++i) {
    const Variable& variable = points.sweep().vary(static_cast<int>(i));
    add(NameOf(variable), points.Text(i, values[i]) + (variable.angle() ? "°" : ""));
  }
  if (row.limit) add(NameOf(points.sweep().limit()), fmt::format("{}", *row.limit));
  return text;
}

namespace {

struct RunLines {
  int count = 0;
  std::string text;
};

/// A line each for the runs for which `told` holds, the first of them.
template <class Told>
RunLines LinesOf(const SweepHeader& header, const SweepRows& rows, const Told& told) {
  constexpr int kMost = 20;
  const SweepPoints points(header.sweep);
  RunLines lines;
  for (const auto& [key, row] : rows) {
    if (!told(row) || ++lines.count > kMost) continue;
    lines.text += fmt::format("  run {}, {}: {}\n", row.run, PlaceText(points, row),
                              logging::LinesForTerminal(row.Ending()));
  }
  if (lines.count > kMost) lines.text += fmt::format("  and {} more\n", lines.count - kMost);
  return lines;
}

}  // namespace

std::string FormatUntold(const SweepHeader& header, const SweepRows& rows) {
  const RunLines lines = LinesOf(header, rows, [](const SweepRow& row) { return !row.survived(); });
  if (lines.count == 0) return "";
  return fmt::format("{} run{} not tell whether the robot stood, and count{} for nothing:\n{}",
                     lines.count, lines.count == 1 ? " does" : "s do", lines.count == 1 ? "s" : "",
                     lines.text);
}

std::string FormatMissed(const SweepHeader& header, const SweepRows& rows) {
  const RunLines lines = LinesOf(header, rows, [](const SweepRow& row) { return row.missed(); });
  if (lines.count == 0) return "";
  return fmt::format("{} run{} stood and did not do what is asked:\n{}", lines.count,
                     lines.count == 1 ? "" : "s", lines.text);
}

}  // namespace poise
