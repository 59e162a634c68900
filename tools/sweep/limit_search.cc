#include "tools/sweep/limit_search.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace poise {
namespace {

constexpr double kDefaultTolerance = 1.0 / 200;  // of max - min
// Beyond max each value is farther from min than the one before by this share, or by a step of the
// samples if that is more.
constexpr double kRaise = 0.25;

double ToleranceOf(const Limit& limit) {
  return limit.has_tolerance() ? limit.tolerance()
                               : kDefaultTolerance * (limit.max() - limit.min());
}

}  // namespace

LimitSearch::LimitSearch(const Limit& limit)
    : tolerance_(ToleranceOf(limit)), cap_(limit.has_cap() ? limit.cap() : limit.max()) {
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
  if (Edge() == answers_.end()) {
    const double top = answers_.rbegin()->first, min = samples_.front();
    const double step = (samples_.back() - min) / static_cast<double>(samples_.size() - 1);
    if (top < cap_) wanted.push_back(std::min(cap_, top + std::max(step, kRaise * (top - min))));
    return wanted;
  }
  const auto bisect = [&](double survived, double failed) {
    const double middle = survived + (failed - survived) / 2;
    if (failed - survived > tolerance_ && middle > survived && middle < failed) {
      wanted.push_back(middle);
    }
  };
  if (limit() && fails_at()) bisect(*limit(), *fails_at());
  if (survived_again() && largest_survived()) {
    const auto above = answers_.upper_bound(*largest_survived());
    if (above != answers_.end()) bisect(*largest_survived(), above->first);
  }
  return wanted;
}

LimitSearch::Answers::const_iterator LimitSearch::Edge() const {
  return std::ranges::find_if(answers_, [](const auto& answer) { return answer.second != true; });
}

bool LimitSearch::known() const {
  const auto edge = Edge();
  return edge == answers_.end() || edge->second.has_value();
}

std::optional<double> LimitSearch::limit() const {
  const auto edge = Edge();
  if (!known() || edge == answers_.begin()) return {};
  return std::prev(edge)->first;
}

std::optional<double> LimitSearch::fails_at() const {
  const auto edge = Edge();
  if (!known() || edge == answers_.end()) return {};
  return edge->first;
}

std::optional<double> LimitSearch::largest_survived() const {
  for (auto answer = answers_.rbegin(); answer != answers_.rend(); ++answer) {
    if (!answer->second) return {};
    if (*answer->second) return answer->first;
  }
  return {};
}

std::optional<bool> LimitSearch::monotone() const {
  bool fell = false, told = known();
  for (const auto& [value, survived] : answers_) {
    if (fell && survived == true) return false;
    fell = fell || survived == false;
    told = told && survived.has_value();
  }
  return told ? std::optional(true) : std::nullopt;
}

int LimitSearch::ExpectedRuns(const Limit& limit) {
  const double step = (limit.max() - limit.min()) / (limit.samples() - 1);
  const double halvings = std::ceil(std::log2(step / ToleranceOf(limit)));
  return limit.samples() + std::max(0, static_cast<int>(halvings));
}

}  // namespace poise
