#include "tools/sweep/sweep_agreement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "fmt/format.h"
#include "fmt/ranges.h"
#include "tools/sweep/sweep_points.h"

namespace poise {
namespace {

constexpr size_t kShownRuns = 10;

/// Largest value of `variable` that stands, by the place of the other variables; empty: none does.
/// Places with a run that does not tell are left out.
using Largest = std::map<std::vector<std::pair<double, int>>, std::optional<double>>;

Largest LargestSurvived(const SweepPoints& points, size_t variable, const SweepRows& rows) {
  Largest largest;
  std::set<Largest::key_type> untold;
  for (const auto& [key, row] : rows) {
    const std::vector<SweepValue> place = points.At(row.run);
    std::vector<std::pair<double, int>> others;
    for (size_t i = 0; i < place.size(); ++i) {
      if (i != variable) others.emplace_back(place[i].number, place[i].choice);
    }
    std::optional<double>& value = largest[others];
    const double number = place[variable].number;
    if (!row.survived()) untold.insert(others);
    if (row.stands()) value = value ? std::max(*value, number) : number;
  }
  for (const Largest::key_type& place : untold) largest.erase(place);
  return largest;
}

std::string LargestText(const Variable& variable, const Largest& first, const Largest& second) {
  size_t points = 0, same = 0;
  double most = 0, share = 0;
  for (const auto& [place, value] : first) {
    const auto other = second.find(place);
    if (other == second.end()) continue;
    ++points;
    same += value == other->second ? 1 : 0;
    if (!value || !other->second) continue;
    const double difference = std::abs(*value - *other->second);
    most = std::max(most, difference);
    const double larger = std::max(std::abs(*value), std::abs(*other->second));
    if (larger > 0) share = std::max(share, difference / larger);
  }
  const std::string unit = variable.unit().empty() ? "" : " " + variable.unit();
  return fmt::format(
      "largest {} that stands: the same at {} of {} points; apart by at most {:.4g}{}, "
      "{:.1f} %\n",
      NameOf(variable), same, points, most, unit, 100 * share);
}

}  // namespace

std::string FormatAgreement(const Sweep& sweep, const EngineRows& first, const EngineRows& second) {
  std::map<std::pair<std::string, std::string>, std::vector<int64_t>> differ;
  size_t runs = 0, same = 0, stand_first = 0, stand_second = 0, untold = 0;
  for (const auto& [key, row] : first.rows) {
    const auto found = second.rows.find(key);
    if (found == second.rows.end()) continue;
    const SweepRow& other = found->second;
    if (!row.survived() || !other.survived()) {
      ++untold;
      continue;
    }
    ++runs;
    stand_first += row.stands() ? 1 : 0;
    stand_second += other.stands() ? 1 : 0;
    if (row.outcome == other.outcome) {
      ++same;
    } else {
      differ[{row.outcome, other.outcome}].push_back(row.run);
    }
  }
  const std::string lacking =
      untold == 0 ? ""
                  : fmt::format(
                        "{} run{} that were stopped, crashed, hung or cannot be made, in one "
                        "engine or both, {} left out\n",
                        untold, untold == 1 ? "" : "s", untold == 1 ? "is" : "are");
  if (runs == 0) return "no run to compare\n" + lacking;
  std::string text =
      fmt::format("the same outcome in {} of {} runs ({:.1f} %); stand: {} {}, {} {}\n", same, runs,
                  100.0 * static_cast<double>(same) / static_cast<double>(runs), first.engine,
                  stand_first, second.engine, stand_second);
  text += lacking;
  for (const auto& [outcomes, which] : differ) {
    const std::vector<int64_t> shown(
        which.begin(),
        which.begin() + static_cast<std::ptrdiff_t>(std::min(which.size(), kShownRuns)));
    text += fmt::format("{} in {}, {} in {}: {} runs: {}{}\n", outcomes.first, first.engine,
                        outcomes.second, second.engine, which.size(), fmt::join(shown, ", "),
                        which.size() > shown.size() ? ", ..." : "");
  }
  if (sweep.has_random()) return text;
  const SweepPoints points(sweep);
  for (int i = 0; i < sweep.vary_size(); ++i) {
    const Variable& variable = sweep.vary(i);
    if (variable.angle() || variable.choice_size() > 0) continue;
    const auto v = static_cast<size_t>(i);
    text += LargestText(variable, LargestSurvived(points, v, first.rows),
                        LargestSurvived(points, v, second.rows));
  }
  return text;
}

}  // namespace poise
