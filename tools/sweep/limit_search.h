// The largest survivable value of a quantity, where survival need not be monotone.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "tools/sweep/sweep.pb.h"

namespace poise {

/// Asks for values until it knows the limit: first `samples` of them from min to max; where all are
/// survived, larger ones until one is not, up to the cap; then, within `tolerance`, the lowest
/// boundary at which survival ends, and the highest one if that is another. What it asks for
/// depends on the answers alone, not on their order.
class LimitSearch {
 public:
  /// `limit` must have passed CheckVariables.
  explicit LimitSearch(const Limit& limit);

  /// Values to try whose answers are not known; empty: finished.
  std::vector<double> Wanted() const;
  /// `survived`: empty for a run that does not tell: it is not tried again, and a boundary beside
  /// it stays unknown.
  void Add(double value, std::optional<bool> survived) { answers_[value] = survived; }

  /// False when a run that does not tell comes before the first value that was not survived: then
  /// there is neither limit() nor fails_at().
  bool known() const;
  /// The largest value below which all that was tried survived; empty: not even min did.
  std::optional<double> limit() const;
  /// The smallest value tried that was not survived; empty: all were, up to the cap.
  std::optional<double> fails_at() const;
  /// The largest value tried that survived; empty: none did, or above it is a run that does not
  /// tell.
  std::optional<double> largest_survived() const;
  /// False when something above a value that was not survived was; empty: not known, for runs that
  /// do not tell.
  std::optional<bool> monotone() const;
  /// Whether something above a value that was not survived was.
  bool survived_again() const { return monotone() == std::optional(false); }
  /// Runs that one monotone boundary takes.
  static int ExpectedRuns(const Limit& limit);
  int tried() const { return static_cast<int>(answers_.size()); }

 private:
  using Answers = std::map<double, std::optional<bool>>;
  /// The first answer that is not "survived".
  Answers::const_iterator Edge() const;

  std::vector<double> samples_;
  double tolerance_, cap_;
  Answers answers_;
};

}  // namespace poise
