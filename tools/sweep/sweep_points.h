// The runs of a sweep: which values their variables have, and which fields that changes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/sweep/sweep.pb.h"

namespace poise {

inline constexpr int64_t kMaxSweepRuns = 1'000'000;

/// A variable in one run.
struct SweepValue {
  double number = 0;
  int choice = -1;  ///< of a variable of choices; -1: a number
};

/// Name of a variable, and of the quantity whose limit is sought.
const std::string& NameOf(const Variable& variable);
const std::string& NameOf(const Limit& limit);

/// Numbered runs. Any of them is found without the others: a grid counts through the values, the
/// last variable fastest; a random run draws from a stream of its own.
class SweepPoints {
 public:
  /// `sweep` must have passed CheckVariables.
  explicit SweepPoints(const Sweep& sweep);

  int64_t size() const { return size_; }
  std::vector<SweepValue> At(int64_t run) const;
  /// The value in words: "22.5", or a choice's name.
  std::string Text(size_t variable, const SweepValue& value) const;
  /// The grid's values of a variable, or its choices; empty for one that is drawn.
  std::vector<SweepValue> Values(size_t variable) const;
  /// What `run` changes in the scenario, as --set takes it, in order. `limit`: the value of the
  /// quantity whose limit is sought. Throws ConfigError naming the run for an expression without a
  /// finite value.
  std::vector<std::string> Changes(int64_t run, const std::optional<double>& limit) const;

  const Sweep& sweep() const { return sweep_; }

 private:
  SweepValue Draw(const Variable& variable, double share) const;

  Sweep sweep_;
  std::vector<std::vector<SweepValue>> values_;  // by variable; empty: drawn
  int64_t size_ = 1;
};

/// Checks the variables, assignments and limit by themselves; nothing is known of the scenario's
/// fields. `limit`: a limit is sought. Throws ConfigError of the first problem, with the field's
/// path in the sweep, "vary[1].steps".
void CheckVariables(const Sweep& sweep, bool limit);

}  // namespace poise
