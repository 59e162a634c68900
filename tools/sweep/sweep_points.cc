#include "tools/sweep/sweep_points.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"
#include "sim/random.h"
#include "tools/scenario/scenario.pb.h"
#include "tools/sweep/sweep_expression.h"

namespace poise {
namespace {

constexpr double kFullTurn = 360;
// What a table has beside the variables.
constexpr const char* kReserved[] = {"run",     "outcome", "fell_at", "ended_at",  "phase",
                                     "trouble", "reason",  "stands",  "component", "stage"};

bool IsFullTurn(const Variable& v) { return v.angle() && std::abs(v.to() - v.from()) == kFullTurn; }

/// The value at `share` (0 to 1) of the way.
double Between(const Variable& v, double share) {
  double number = v.from() + share * (v.to() - v.from());
  if (v.scale() == Variable::LOGARITHMIC) number = v.from() * std::pow(v.to() / v.from(), share);
  if (share == 1) number = v.to();
  return v.whole() ? std::round(number) : number;
}

std::vector<SweepValue> GridValues(const Variable& v) {
  std::vector<SweepValue> values;
  for (int i = 0; i < v.choice_size(); ++i) values.push_back({static_cast<double>(i), i});
  for (const double number : v.value()) values.push_back({number, -1});
  const double last = IsFullTurn(v) ? v.steps() : std::max(1, v.steps() - 1);
  for (int i = 0; i < v.steps(); ++i) values.push_back({Between(v, i / last), -1});
  return values;
}

// The checks throw ConfigError, with the field's path in the sweep.

void CheckExpressionName(const std::string& field, const std::string& name) {
  if (IsExpressionName(name)) return;
  throw ConfigError(field, fmt::format("is '{}'; use letters, digits and _, and not the name of a "
                                       "function or constant",
                                       name));
}

void CheckName(const std::string& path, bool has_name, const std::string& name,
               const std::string& field) {
  if (!has_name && field.empty()) {
    throw ConfigError(path + ".field", "is missing; give a field, a name, or both");
  }
  if (has_name) CheckExpressionName(path + ".name", name);
  if (std::find(std::begin(kReserved), std::end(kReserved), name) != std::end(kReserved)) {
    throw ConfigError(path + ".name", fmt::format("is '{}', a column of every table", name));
  }
}

void CheckVariable(const Variable& v, const std::string& path, bool random) {
  const bool range = v.has_from() || v.has_to();
  const int kinds = (range ? 1 : 0) + (v.value_size() > 0 ? 1 : 0) + (v.choice_size() > 0 ? 1 : 0);
  if (kinds != 1) throw ConfigError(path, "needs either from and to, or value, or choice");
  std::set<std::string> names;
  for (int i = 0; i < v.choice_size(); ++i) {
    const std::string field = fmt::format("{}.choice[{}]", path, i);
    if (v.choice(i).name().empty()) throw ConfigError(field, "has no name");
    if (!names.insert(v.choice(i).name()).second) {
      throw ConfigError(field + ".name",
                        fmt::format("there are two choices named '{}'", v.choice(i).name()));
    }
  }
  if (v.choice_size() > 0 && v.has_field()) {
    throw ConfigError(path + ".field", "has no number to take; let the choices set it");
  }
  if (!range) {
    if (v.has_steps()) throw ConfigError(path + ".steps", "goes with from and to");
    return;
  }
  RequireFields(v, {"from", "to"}, path + ".");
  if (v.scale() == Variable::LOGARITHMIC && !(v.from() > 0 && v.to() > 0)) {
    throw ConfigError(path + ".scale", "is logarithmic: from and to must be more than 0");
  }
  if (random) {
    if (v.has_steps()) throw ConfigError(path + ".steps", "is of a grid; this sweep is random");
    return;
  }
  RequireFields(v, {"steps"}, path + ".");
}

void CheckLimit(const Limit& limit) {
  CheckName("limit", limit.has_name(), limit.name(), limit.field());
  RequireFields(limit, {"min", "max"}, "limit.");
  if (!(limit.max() > limit.min())) throw ConfigError("limit.max", "must be more than min");
  if (limit.has_cap() && limit.cap() < limit.max()) {
    throw ConfigError("limit.cap", "must be max or more");
  }
  const double range = limit.max() - limit.min();
  if (limit.has_tolerance() && !(limit.tolerance() >= 1e-9 * range && limit.tolerance() <= range)) {
    throw ConfigError("limit.tolerance", fmt::format("is {}; must be {} to {}", limit.tolerance(),
                                                     1e-9 * range, range));
  }
}

}  // namespace

const std::string& NameOf(const Variable& variable) {
  return variable.has_name() ? variable.name() : variable.field();
}

const std::string& NameOf(const Limit& limit) {
  return limit.has_name() ? limit.name() : limit.field();
}

SweepPoints::SweepPoints(const Sweep& sweep) : sweep_(sweep) {
  for (const Variable& v : sweep_.vary()) {
    values_.push_back(sweep_.has_random() ? std::vector<SweepValue>{} : GridValues(v));
    if (!sweep_.has_random()) size_ *= static_cast<int64_t>(values_.back().size());
  }
  if (sweep_.has_random()) size_ = sweep_.random();
}

SweepValue SweepPoints::Draw(const Variable& v, double share) const {
  const auto pick = [&](int count) {
    return std::min(count - 1, static_cast<int>(share * static_cast<double>(count)));
  };
  if (v.choice_size() > 0) {
    const int choice = pick(v.choice_size());
    return {static_cast<double>(choice), choice};
  }
  if (v.value_size() > 0) return {v.value(pick(v.value_size())), -1};
  if (!v.whole()) return {Between(v, share), -1};
  // Every whole number of the range as often as any other.
  const double low = std::ceil(std::min(v.from(), v.to()));
  const double high = std::floor(std::max(v.from(), v.to()));
  if (v.scale() == Variable::LOGARITHMIC || high < low) return {Between(v, share), -1};
  return {std::min(high, low + std::floor(share * (high - low + 1))), -1};
}

std::vector<SweepValue> SweepPoints::At(int64_t run) const {
  std::vector<SweepValue> point(values_.size());
  if (sweep_.has_random()) {
    RandomStream random(sweep_.seed(), static_cast<uint64_t>(run));
    for (size_t i = 0; i < point.size(); ++i) {
      point[i] = Draw(sweep_.vary(static_cast<int>(i)), random.Uniform());
    }
    return point;
  }
  for (size_t i = point.size(); i-- > 0;) {
    const auto count = static_cast<int64_t>(values_[i].size());
    point[i] = values_[i][static_cast<size_t>(run % count)];
    run /= count;
  }
  return point;
}

std::vector<SweepValue> SweepPoints::Values(size_t variable) const { return values_[variable]; }

std::string SweepPoints::Text(size_t variable, const SweepValue& value) const {
  const Variable& v = sweep_.vary(static_cast<int>(variable));
  return value.choice >= 0 ? v.choice(value.choice).name() : fmt::format("{}", value.number);
}

std::vector<std::string> SweepPoints::Changes(int64_t run,
                                              const std::optional<double>& limit) const {
  std::vector<std::string> changes;
  std::map<std::string, double> numbers;
  for (const Constant& constant : sweep_.constant()) numbers[constant.name()] = constant.value();
  std::string where = fmt::format("run {}", run);
  const auto add_number = [&](const std::string& name, const std::string& field, double number) {
    if (IsExpressionName(name)) numbers[name] = number;
    if (!field.empty()) changes.push_back(fmt::format("{}={}", field, number));
    where += fmt::format(", {} {}", name, number);
  };
  const std::vector<SweepValue> point = At(run);
  for (size_t i = 0; i < point.size(); ++i) {
    const Variable& v = sweep_.vary(static_cast<int>(i));
    if (point[i].choice < 0) {
      add_number(NameOf(v), v.field(), point[i].number);
    } else {
      const auto& set = v.choice(point[i].choice).set();
      changes.insert(changes.end(), set.begin(), set.end());
    }
  }
  if (limit) add_number(NameOf(sweep_.limit()), sweep_.limit().field(), *limit);
  for (const Assignment& assign : sweep_.assign()) {
    try {
      changes.push_back(fmt::format("{}={}", assign.field(), Evaluate(assign.value(), numbers)));
    } catch (const ExpressionError& error) {
      throw ConfigError(
          fmt::format("{} = {}: {} ({})", assign.field(), assign.value(), error.what(), where));
    }
  }
  return changes;
}

void CheckVariables(const Sweep& sweep, bool limit) {
  CheckFields(sweep);
  double runs = sweep.has_random() ? static_cast<double>(sweep.random()) : 1;
  for (const Variable& v : sweep.vary()) {
    if (!sweep.has_random())
      runs *= v.choice_size() + v.value_size() + static_cast<double>(v.steps());
  }
  if (runs > static_cast<double>(kMaxSweepRuns)) {
    throw ConfigError(sweep.has_random() ? "random" : "vary",
                      fmt::format("makes {:g} runs; at most {}", runs, kMaxSweepRuns));
  }
  std::map<std::string, double> numbers;
  std::set<std::string> names;
  for (int i = 0; i < sweep.constant_size(); ++i) {
    const Constant& constant = sweep.constant(i);
    const std::string path = fmt::format("constant[{}].", i);
    CheckExpressionName(path + "name", constant.name());
    RequireFields(constant, {"value"}, path);
    if (!names.insert(constant.name()).second) {
      throw ConfigError(path + "name",
                        fmt::format("is '{}', as another constant's is", constant.name()));
    }
    numbers[constant.name()] = constant.value();
  }
  for (int i = 0; i < sweep.vary_size(); ++i) {
    const Variable& v = sweep.vary(i);
    const std::string path = fmt::format("vary[{}]", i);
    CheckName(path, v.has_name(), v.name(), v.field());
    CheckVariable(v, path, sweep.has_random());
    if (!names.insert(NameOf(v)).second) {
      throw ConfigError(path, fmt::format("there are two variables named '{}'", NameOf(v)));
    }
    const SweepPoints one([&] {
      Sweep alone;
      *alone.add_vary() = v;
      if (sweep.has_random()) alone.set_random(1);
      return alone;
    }());
    if (v.choice_size() == 0 && IsExpressionName(NameOf(v))) {
      numbers[NameOf(v)] = one.At(0)[0].number;
    }
  }
  if (limit) {
    CheckLimit(sweep.limit());
    if (!names.insert(NameOf(sweep.limit())).second) {
      throw ConfigError("limit", fmt::format("is '{}', a variable of `vary`; leave it out there",
                                             NameOf(sweep.limit())));
    }
    if (IsExpressionName(NameOf(sweep.limit()))) {
      numbers[NameOf(sweep.limit())] = sweep.limit().min();
    }
  } else if (sweep.vary_size() == 0) {
    throw ConfigError("vary", "is missing: nothing differs from run to run");
  }
  for (int i = 0; i < sweep.assign_size(); ++i) {
    const std::string path = fmt::format("assign[{}]", i);
    if (sweep.assign(i).field().empty()) throw ConfigError(path, "has no field");
    try {
      Evaluate(sweep.assign(i).value(), numbers);
    } catch (const ExpressionError& error) {
      throw ConfigError(path + ".value",
                        fmt::format("'{}' {}", sweep.assign(i).value(), error.what()));
    }
  }
  const auto check_used = [&](const std::string& path, const std::string& name) {
    if (std::ranges::any_of(sweep.assign(), [&](const Assignment& assign) {
          return HasVariable(assign.value(), name);
        })) {
      return;
    }
    std::vector<std::string> fields;
    const auto& scenario = *Scenario::descriptor();
    for (int i = 0; i < scenario.field_count(); ++i) fields.push_back(scenario.field(i)->name());
    const std::vector<std::string> near = Nearest(name, fields);
    throw ConfigError(
        path, fmt::format("'{}' is no field of a scenario, and no expression uses it{}", name,
                          near.empty() ? "" : fmt::format("; did you mean {}?", near.front())));
  };
  for (int i = 0; i < sweep.vary_size(); ++i) {
    const Variable& v = sweep.vary(i);
    if (!v.has_field() && v.choice_size() == 0) check_used(fmt::format("vary[{}]", i), v.name());
  }
  if (limit && !sweep.limit().has_field()) check_used("limit.name", sweep.limit().name());
}

}  // namespace poise
