#include "tools/live/message_text.h"

#include <algorithm>

#include "fmt/format.h"
#include "logging/printable.h"

namespace poise {
namespace {

constexpr char kTick[] = "tick";

/// A value's text: a real's format, and how a text's own quotes are written.
struct Format {
  const char* real;
  const char* quote;
  std::string operator()(int64_t value) const { return fmt::format("{}", value); }
  std::string operator()(double value) const { return fmt::format(fmt::runtime(real), value); }
  std::string operator()(const std::string& value) const {
    return '"' + logging::Printable(value, quote) + '"';
  }
};

std::string ShortValue(const Scalar& scalar) {
  const std::string value = std::visit(Format{"{:.6g}", "\\\""}, scalar.value);
  return scalar.name.empty() ? value : fmt::format("{}({})", value, scalar.name);
}

std::string CsvValue(const Scalar& scalar) {
  return std::visit(Format{"{}", "\"\""}, scalar.value);
}

/// Writes one cell for each field. `tick` (empty: none) stands in front unless it is among them.
template <class Cell>
std::string Row(const std::string& tick, const std::vector<Scalar>& fields, char separator,
                Cell cell) {
  const bool selected = std::ranges::find(fields, kTick, &Scalar::path) != fields.end();
  std::string row = selected ? "" : tick;
  for (const Scalar& field : fields) {
    if (!row.empty()) row += separator;
    row += cell(field);
  }
  return row + '\n';
}

/// "torque" of "torque[3]": elements of one array share a line.
std::string_view ArrayOf(std::string_view path) {
  return path.ends_with(']') ? path.substr(0, path.rfind('[')) : path;
}

/// "right_knee_pitch" of "torque[right_knee_pitch]"; empty: no element of an array with names.
std::string_view ElementName(std::string_view path) {
  const size_t open = path.find('[');
  if (!path.ends_with(']') || path.find(']') != path.size() - 1) return "";
  const std::string_view name = path.substr(open + 1, path.size() - open - 2);
  return name.find_first_not_of("0123456789") == std::string_view::npos ? "" : name;
}

/// Arrays over the same named elements.
struct NamedTable {
  std::vector<std::string_view> elements;         // rows
  std::vector<std::vector<std::string>> columns;  // each: heading, then a text a row
};

std::vector<NamedTable> NamedTables(const std::vector<Scalar>& fields) {
  std::vector<NamedTable> tables;
  for (size_t i = 0; i < fields.size();) {
    const std::string_view array = ArrayOf(fields[i].path);
    NamedTable table;
    std::vector<std::string> column = {std::string(array)};
    while (i < fields.size() && ArrayOf(fields[i].path) == array &&
           !ElementName(fields[i].path).empty()) {
      table.elements.push_back(ElementName(fields[i].path));
      column.push_back(ShortValue(fields[i++]));
    }
    if (table.elements.empty()) {
      ++i;
      continue;
    }
    const auto same = std::ranges::find(tables, table.elements, &NamedTable::elements);
    if (same == tables.end()) {
      table.columns.push_back(std::move(column));
      tables.push_back(std::move(table));
    } else {
      same->columns.push_back(std::move(column));
    }
  }
  return tables;
}

std::string TableText(const NamedTable& table) {
  size_t width = 0;
  for (const std::string_view element : table.elements) width = std::max(width, element.size());
  std::string text;
  for (size_t row = 0; row <= table.elements.size(); ++row) {
    text += fmt::format("  {:<{}}", row == 0 ? "" : table.elements[row - 1], width);
    for (const std::vector<std::string>& column : table.columns) {
      size_t widest = 0;
      for (const std::string& cell : column) widest = std::max(widest, cell.size());
      text += fmt::format("  {:>{}}", column[row], widest);
    }
    text += '\n';
  }
  return text;
}

}  // namespace

std::string MessageLine(std::optional<int64_t> tick, const std::vector<Scalar>& fields) {
  return Row(tick ? fmt::format("{}={}", kTick, *tick) : "", fields, ' ',
             [](const Scalar& field) { return field.path + '=' + ShortValue(field); });
}

std::string MessageBlock(std::string_view title, const std::vector<Scalar>& fields) {
  size_t width = 0;
  for (const Scalar& field : fields) {
    if (ElementName(field.path).empty()) width = std::max(width, ArrayOf(field.path).size());
  }
  std::string block = fmt::format("{}\n", title);
  std::string_view open;  // the array whose line is being written
  for (const Scalar& field : fields) {
    if (!ElementName(field.path).empty()) continue;  // below
    const std::string_view name = ArrayOf(field.path);
    if (name == open) {
      block += ' ' + ShortValue(field);
      continue;
    }
    if (!open.empty()) block += "]\n";
    open = name.size() < field.path.size() ? name : std::string_view();
    block += fmt::format("  {:<{}}  {}{}", name, width, open.empty() ? "" : "[", ShortValue(field));
    if (open.empty()) block += '\n';
  }
  if (!open.empty()) block += "]\n";
  for (const NamedTable& table : NamedTables(fields)) block += TableText(table);
  return block + '\n';
}

std::string CsvHeader(bool has_tick, const std::vector<Scalar>& fields) {
  return Row(has_tick ? kTick : "", fields, ',', [](const Scalar& field) { return field.path; });
}

std::string CsvRow(std::optional<int64_t> tick, const std::vector<Scalar>& fields) {
  return Row(tick ? fmt::format("{}", *tick) : "", fields, ',', CsvValue);
}

bool Thinner::Pass(double time) {
  if (period_ == 0) return true;
  // A time far before the next is another run in the same log.
  if (begun_ && time < next_ && time > next_ - 2 * period_) return false;
  // Times stay on the grid of the first one while that holds, so that the rate is met on average.
  next_ = begun_ && time >= next_ && time < next_ + period_ ? next_ + period_ : time + period_;
  begun_ = true;
  return true;
}

}  // namespace poise
