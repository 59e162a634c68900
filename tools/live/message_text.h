// Messages as text: for people line by line or whole, for programs as CSV.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/live/field_selection.h"

namespace poise {

/// "tick=120 torque[3]=1.25" and a line feed; tick first unless it is among the fields. Reals with
/// six digits.
std::string MessageLine(std::optional<int64_t> tick, const std::vector<Scalar>& fields);

/// A title line, then a line for each field, the elements of an array together; then the arrays of
/// named elements as tables, a row an element; then an empty line.
std::string MessageBlock(std::string_view title, const std::vector<Scalar>& fields);

/// Column names, and a message's row; "tick" first unless it is among the fields. Reals with as
/// many digits as give the same number back; texts escaped as in logging::Printable, but quotes
/// doubled.
std::string CsvHeader(bool has_tick, const std::vector<Scalar>& fields);
std::string CsvRow(std::optional<int64_t> tick, const std::vector<Scalar>& fields);

/// Thins a stream out to a rate.
class Thinner {
 public:
  /// Hz; 0: lets everything pass.
  explicit Thinner(double rate) : period_(rate > 0 ? 1e9 / rate : 0) {}
  /// Whether the message of this time passes, ns.
  bool Pass(double time);

 private:
  double period_;  // ns
  double next_ = 0;
  bool begun_ = false;
};

}  // namespace poise
