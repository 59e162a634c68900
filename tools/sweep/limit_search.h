// The largest survivable value of a quantity, where survival need not be monotone.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "tools/sweep/sweep.pb.h"

namespace poise {

/// Asks for values until it knows the limit: first `samples` of them from min to max, then, within
/// `tolerance`, the lowest boundary at which survival ends, and the highest one if that is another.
/// What it asks for depends on the answers alone, not on their order.
class LimitSearch {
 public:
  /// `limit` must have passed CheckVariables.
  explicit LimitSearch(const Limit& limit);

  /// Values to try whose answers are not known; empty: finished.
  std::vector<double> Wanted() const;
  void Add(double value, bool survived) { answers_[value] = survived; }

  /// The largest value below which all that was tried survived; empty: not even min did.
  std::optional<double> limit() const;
  /// The smallest value tried that was not survived; empty: all were.
  std::optional<double> fails_at() const;
  /// The largest value tried that survived.
  std::optional<double> largest_survived() const;
  /// False when something above fails_at() survived.
  bool monotone() const { return limit() == largest_survived(); }
  /// Runs that one monotone boundary takes.
  static int ExpectedRuns(const Limit& limit);
  int tried() const { return static_cast<int>(answers_.size()); }

 private:
  std::vector<double> samples_;
  double tolerance_;
  std::map<double, bool> answers_;
};

}  // namespace poise
