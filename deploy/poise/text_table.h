// Tables in plain text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace poise {

/// "12.35", "3": at most four digits, or all before the point.
std::string FormatNumber(double value);
std::string FormatNumber(double value, const std::string& unit);

/// "a, b, c" of {"a", "b", "c"} and ", ".
std::string Joined(const std::vector<std::string>& parts, std::string_view separator);

/// The rows in aligned columns, a line below the first one, the heading. All rows have as many
/// cells as it; UTF-8.
std::string FormatColumns(const std::vector<std::vector<std::string>>& rows);

/// `text` as a cell of a CSV file (RFC 4180): in quotes where it must be.
std::string CsvCell(const std::string& text);

}  // namespace poise
