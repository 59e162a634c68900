// Tables in plain text.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fmt/format.h"
#include "logging/printable.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_style.h"

namespace poise {

/// "12.35", "3": at most four digits, or all before the point.
std::string FormatNumber(double value);
std::string FormatNumber(double value, const std::string& unit);

struct TableCell {
  TableCell(const char* t) : text(t) {}               // NOLINT: a text is a cell
  TableCell(std::string t, Tone tone = Tone::kPlain)  // NOLINT
      : text(std::move(t)), tone(tone) {}
  std::string text;
  Tone tone = Tone::kPlain;
};
using TableRow = std::vector<TableCell>;

/// The rows in aligned columns, a line below the first one, the heading. All rows have as many
/// cells as it; UTF-8. Where they do not fit `width`, long cells are wrapped between words, and
/// what still does not fit comes in further blocks below, the first column again in each. A word
/// that is too long even there is broken. What is no printable text is escaped.
std::string FormatColumns(std::vector<TableRow> rows, int width = ScreenStyle().columns);

using logging::CsvCell;
/// A line of a CSV file, with its end.
std::string CsvLine(const std::vector<std::string>& cells);
/// A number as a cell of a CSV file; empty without one.
template <class Number>
std::string CsvNumber(const std::optional<Number>& value) {
  return value ? fmt::format("{}", *value) : "";
}

}  // namespace poise
