#include "tools/charts/sweep_edge.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "fmt/format.h"
#include "tools/charts/sweep_labels.h"
#include "tools/cli/text_table.h"
#include "tools/sweep/sweep_points.h"
#include "tools/sweep/sweep_table.h"

namespace poise {
namespace {

constexpr double kTelling = 0.7;  // of a variable's range: failures spread wider tell nothing
constexpr size_t kMostStretches = 6;
constexpr size_t kMostGroups = 8;  // that are told one by one

/// Runs at one value of the variable, of which some may stand.
struct Level {
  int runs = 0, standing = 0;
  bool stands() const { return standing == runs; }
};
using Levels = std::map<double, Level>;

/// The runs that the other variables have in common.
struct Group {
  std::string place;  ///< those variables in words
  Levels levels;
  Levels::const_iterator edge() const {
    return std::ranges::find_if(levels, [](const auto& level) { return !level.second.stands(); });
  }
  /// Whether the boundary lies between two of its levels.
  bool tells() const { return edge() != levels.begin() && edge() != levels.end(); }
};

class Sentences {
 public:
  Sentences(const SweepHeader& header, const SweepRows& rows)
      : header_(header), rows_(rows), points_(header.sweep) {
    for (const auto& [key, row] : rows) {
      standing_ += row.stands() ? 1 : 0;
      untold_ += row.survived() ? 0 : 1;
    }
  }

  std::vector<std::string> All() const;

 private:
  std::vector<std::string> OfSweep() const;
  std::vector<std::string> OfLimits() const;
  const Variable& variable(size_t i) const { return header_.sweep.vary(static_cast<int>(i)); }
  size_t count() const { return static_cast<size_t>(header_.sweep.vary_size()); }
  bool IsNumber(size_t i) const { return variable(i).choice_size() == 0; }
  static std::string Quantity(double value, const std::string& unit) {
    // What a unit says beside itself ("m, from the expected") stands at the axis.
    const std::string short_unit = unit.substr(0, unit.find(','));
    return short_unit == "°" ? FormatNumber(value) + "°" : FormatNumber(value, short_unit);
  }
  std::string Place(const std::vector<SweepValue>& point, std::optional<size_t> without) const;
  std::string Stretches(const Levels& levels, bool standing, const std::string& unit) const;
  using Groups = std::map<std::vector<double>, Group>;  // by the other variables' values
  Groups GroupsAlong(size_t i) const;
  std::string Along(size_t i, const Groups& groups) const;
  std::string AlongInGroups(size_t i, const Groups& groups) const;
  std::string Failures(size_t i) const;

  const SweepHeader& header_;
  const SweepRows& rows_;
  SweepPoints points_;
  size_t standing_ = 0, untold_ = 0;  // runs
};

/// "direction 90°, law paper".
std::string Sentences::Place(const std::vector<SweepValue>& point,
                             std::optional<size_t> without) const {
  std::string place;
  for (size_t i = 0; i < point.size(); ++i) {
    if (i == without) continue;
    const std::string value =
        IsNumber(i) ? Quantity(point[i].number, UnitOf(variable(i))) : points_.Text(i, point[i]);
    place += fmt::format("{}{} {}", place.empty() ? "" : ", ", PlainName(variable(i)), value);
  }
  return place;
}

/// "50 to 190 N, 230 N": neighbouring levels at which all runs stand, or not all.
std::string Sentences::Stretches(const Levels& levels, bool standing,
                                 const std::string& unit) const {
  std::vector<std::pair<double, double>> stretches;
  bool on = false;
  for (const auto& [value, level] : levels) {
    if (level.stands() != standing) {
      on = false;
      continue;
    }
    if (!on) stretches.emplace_back(value, value);
    stretches.back().second = value;
    on = true;
  }
  std::string text;
  for (size_t i = 0; i < stretches.size(); ++i) {
    if (i == kMostStretches) return text + fmt::format(" and {} more", stretches.size() - i);
    const auto& [from, to] = stretches[i];
    text += i == 0 ? "" : ", ";
    text += from == to ? Quantity(from, unit)
                       : fmt::format("{} to {}", FormatNumber(from), Quantity(to, unit));
  }
  return text;
}

Sentences::Groups Sentences::GroupsAlong(size_t i) const {
  Groups groups;
  for (const auto& [key, row] : rows_) {
    if (!row.survived()) continue;
    const std::vector<SweepValue> point = points_.At(row.run);
    std::vector<double> others;
    for (size_t k = 0; k < point.size(); ++k) {
      if (k != i) others.push_back(point[k].number);
    }
    Group& group = groups[others];
    group.place = Place(point, i);
    Level& level = group.levels[point[i].number];
    ++level.runs;
    level.standing += row.stands() ? 1 : 0;
  }
  return groups;
}

std::string Sentences::AlongInGroups(size_t i, const Groups& groups) const {
  const std::string name = PlainName(variable(i)), unit = UnitOf(variable(i));
  const Group* least = nullptr;
  const Group* most = nullptr;
  std::map<double, std::string> by_value;  // up to which it stands, where
  size_t all = 0, none = 0, broken = 0;
  const auto limit = [](const Group& group) { return std::prev(group.edge())->first; };
  for (const auto& [others, group] : groups) {
    const auto edge = group.edge();
    if (edge == group.levels.end()) {
      ++all;
    } else if (edge == group.levels.begin()) {
      ++none;
    } else {
      if (least == nullptr || limit(group) < limit(*least)) least = &group;
      if (most == nullptr || limit(group) > limit(*most)) most = &group;
      std::string& places = by_value[limit(group)];
      places += (places.empty() ? "" : "; ") + group.place;
    }
    broken += std::any_of(edge, group.levels.end(), [](const auto& l) { return l.second.stands(); })
                  ? 1
                  : 0;
  }
  std::string text;
  if (least != nullptr && by_value.size() == 1) {
    text = fmt::format("It stands up to a {} of {}{}", name, Quantity(limit(*least), unit),
                       all + none == 0 ? fmt::format(" in each of {} places", groups.size())
                                       : fmt::format(" ({})", by_value.begin()->second));
  } else if (least != nullptr && groups.size() <= kMostGroups) {
    text = fmt::format("It stands up to a {} of", name);
    const char* before = " ";
    for (const auto& [value, places] : by_value) {
      text += fmt::format("{}{} ({})", before, Quantity(value, unit), places);
      before = ", ";
    }
  } else if (least != nullptr) {
    text = fmt::format("It stands up to a {} of {} at the least ({}), of {} at the most ({})", name,
                       Quantity(limit(*least), unit), least->place, Quantity(limit(*most), unit),
                       most->place);
  }
  const auto add = [&](size_t number, const std::string& what) {
    if (number == 0) return;
    text += fmt::format("{}{} of {} places {}", text.empty() ? "In " : "; in ", number,
                        groups.size(), what);
  };
  add(all, "it stands at every value");
  add(none,
      fmt::format("not even at {}", Quantity(groups.begin()->second.levels.begin()->first, unit)));
  add(broken, "it stands again beyond a value at which it does not");
  return text + ".";
}

std::string Sentences::Along(size_t i, const Groups& groups) const {
  if (groups.size() > 1) return AlongInGroups(i, groups);
  const Levels& levels = groups.begin()->second.levels;
  const std::string unit = UnitOf(variable(i));
  return fmt::format("{}: stands at {}; does not at {}.", PlainName(variable(i)),
                     Stretches(levels, true, unit), Stretches(levels, false, unit));
}

std::vector<std::string> Sentences::All() const {
  std::vector<std::string> sentences = header_.sweep.has_limit() ? OfLimits() : OfSweep();
  if (untold_ > 0) {
    sentences.push_back(fmt::format(
        "{} run{} not tell whether the robot stood: stopped, crashed, hung, or not to be run.",
        untold_, untold_ == 1 ? " does" : "s do"));
  }
  return sentences;
}

/// Where the runs that do not stand lie, if that is a part of the range; else empty.
std::string Sentences::Failures(size_t i) const {
  double low = INFINITY, high = -INFINITY, from = INFINITY, to = -INFINITY;
  for (const auto& [key, row] : rows_) {
    const double value = points_.At(row.run)[i].number;
    low = std::min(low, value);
    high = std::max(high, value);
    if (!row.fell()) continue;
    from = std::min(from, value);
    to = std::max(to, value);
  }
  if (!(to - from < kTelling * (high - low))) return "";
  const std::string unit = UnitOf(variable(i));
  return fmt::format("{} {} to {} (drawn from {} to {})", PlainName(variable(i)),
                     FormatNumber(from), Quantity(to, unit), FormatNumber(low),
                     Quantity(high, unit));
}

std::vector<std::string> Sentences::OfSweep() const {
  const size_t runs = rows_.size() - untold_;
  if (rows_.empty()) return {"No run is there yet."};
  if (runs == 0) return {};
  if (standing_ == runs)
    return {runs == 1 ? "The one run stands." : fmt::format("All {} runs stand.", runs)};
  if (standing_ == 0) return {fmt::format("None of {} runs stands.", runs)};
  std::vector<std::string> sentences = {fmt::format("{} of {} runs stand, {} {} not.", standing_,
                                                    runs, runs - standing_,
                                                    runs - standing_ == 1 ? "does" : "do")};
  if (!header_.sweep.has_random()) {
    // Survival is told along the number whose values separate the most runs that stand from those
    // that do not: a larger force does, a later push does not.
    std::optional<size_t> best;
    Groups best_groups;
    double best_share = -1;
    for (size_t i = 0; i < count(); ++i) {
      const bool order = !variable(i).angle() && !IsSeed(variable(i));
      if (!IsNumber(i) || (count() > 1 && !order)) continue;
      Groups groups = GroupsAlong(i);
      const auto tell =
          std::ranges::count_if(groups, [](const auto& each) { return each.second.tells(); });
      const double share = static_cast<double>(tell) / static_cast<double>(groups.size());
      if (share <= best_share) continue;
      best = i;
      best_groups = std::move(groups);
      best_share = share;
    }
    if (best) sentences.push_back(Along(*best, best_groups));
    return sentences;
  }
  std::string where;
  for (size_t i = 0; i < count(); ++i) {
    // Seeds have no order: a range of them says nothing.
    const std::string text = IsNumber(i) && !IsSeed(variable(i)) ? Failures(i) : "";
    if (!text.empty()) where += (where.empty() ? "" : "; ") + text;
  }
  if (!where.empty()) sentences.push_back("Those that do not have " + where + ".");
  return sentences;
}

std::vector<std::string> Sentences::OfLimits() const {
  const Limit& limit = header_.sweep.limit();
  const std::string name = PlainName(limit), unit = UnitOf(limit);
  std::optional<std::pair<double, std::string>> least, most;
  std::optional<double> highest;  // of what fell nowhere
  size_t none = 0, open = 0, broken = 0, unknown = 0;
  const std::vector<LimitPoint> found = LimitPoints(header_, rows_);
  if (found.empty()) return {"No run is there yet."};
  for (const LimitPoint& point : found) {
    const std::optional<double> value = point.search.limit();
    broken += point.search.survived_again() ? 1 : 0;
    if (!point.search.known()) {
      ++unknown;
      continue;
    }
    if (value && !point.search.fails_at()) {
      ++open;
      if (!highest || *value > *highest) highest = value;
    }
    if (!value) {
      ++none;
      continue;
    }
    const std::string place = Place(points_.At(point.run), {});
    if (!least || *value < least->first) least = {*value, place};
    if (!most || *value > most->first) most = {*value, place};
  }
  const auto at = [](const std::string& place) {
    return place.empty() ? "" : fmt::format(" ({})", place);
  };
  std::vector<std::string> sentences;
  // What lies between two values that were tried is not known.
  const std::string every =
      fmt::format(" (tried: {} values from {} to {}{}, then finer about where survival ends)",
                  limit.samples(), Quantity(limit.min(), unit), Quantity(limit.max(), unit),
                  limit.has_cap() ? ", larger ones where all of them are survived" : "");
  if (least && least->first == most->first) {
    sentences.push_back(fmt::format("Nothing fell up to a {} of {}{}{}.", name,
                                    Quantity(least->first, unit),
                                    found.size() == 1 ? at(least->second) : "", every));
  } else if (least) {
    sentences.push_back(fmt::format("Nothing fell up to a {} between {}{} and {}{}{}.", name,
                                    Quantity(least->first, unit), at(least->second),
                                    Quantity(most->first, unit), at(most->second), every));
  }
  const auto add = [&](size_t number, const std::string& what) {
    if (number > 0) {
      sentences.push_back(fmt::format("At {} of {} points {}.", number, found.size(), what));
    }
  };
  add(none, fmt::format("not even {} is survived", Quantity(limit.min(), unit)));
  if (highest) {
    add(open, fmt::format("{} is survived, the most that was tried", Quantity(*highest, unit)));
  }
  const std::optional<double> again = found.front().search.largest_survived();
  add(broken, broken == 1 && found.size() == 1
                  ? fmt::format("{} is survived again, beyond one that was not",
                                again ? Quantity(*again, unit) : "something")
                  : "something beyond one that was not is survived again");
  add(unknown, "the limit is not known");
  return sentences;
}

}  // namespace

std::vector<std::string> SurvivalSentences(const SweepHeader& header, const SweepRows& rows) {
  return Sentences(header, rows).All();
}

}  // namespace poise
