#include "tools/sweep/limit_search.h"

#include <algorithm>
#include <cmath>

namespace poise {
namespace {

constexpr double kDefaultTolerance = 1.0 / 200;  // of max - min

double ToleranceOf(const Limit& limit) {
  return limit.has_tolerance() ? limit.tolerance()
                               : kDefaultTolerance * (limit.max() - limit.min());
}

}  // namespace

LimitSearch::LimitSearch(const Limit& limit) : tolerance_(ToleranceOf(limit)) {
  const int last = limit.samples() - 1;
  for (int i = 0; i < last; ++i) {
    samples_.push_back(limit.min() + (limit.max() - limit.min()) * i / last);
  }
  samples_.push_back(limit.max());
}

std::vector<double> LimitSearch::Wanted() const {
  std::vector<double> wanted;
  for (const double value : samples_) {
    if (!answers_.contains(value)) wanted.push_back(value);
  }
  if (!wanted.empty()) return wanted;
  const auto bisect = [&](double survived, double failed) {
    const double middle = survived + (failed - survived) / 2;
    if (failed - survived > tolerance_ && middle > survived && middle < failed) {
      wanted.push_back(middle);
    }
  };
  if (limit() && fails_at()) bisect(*limit(), *fails_at());
  if (!monotone()) {
    const auto above = answers_.upper_bound(*largest_survived());
    if (above != answers_.end()) bisect(*largest_survived(), above->first);
  }
  return wanted;
}

std::optional<double> LimitSearch::limit() const {
  std::optional<double> limit;
  for (const auto& [value, survived] : answers_) {
    if (!survived) break;
    limit = value;
  }
  return limit;
}

std::optional<double> LimitSearch::fails_at() const {
  const auto failed = std::find_if(answers_.begin(), answers_.end(),
                                   [](const auto& answer) { return !answer.second; });
  if (failed == answers_.end()) return {};
  return failed->first;
}

std::optional<double> LimitSearch::largest_survived() const {
  const auto survived = std::find_if(answers_.rbegin(), answers_.rend(),
                                     [](const auto& answer) { return answer.second; });
  if (survived == answers_.rend()) return {};
  return survived->first;
}

int LimitSearch::ExpectedRuns(const Limit& limit) {
  const double step = (limit.max() - limit.min()) / (limit.samples() - 1);
  const double halvings = std::ceil(std::log2(step / ToleranceOf(limit)));
  return limit.samples() + std::max(0, static_cast<int>(halvings));
}

}  // namespace poise
