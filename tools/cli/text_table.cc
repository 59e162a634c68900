#include "tools/cli/text_table.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr int kGap = 2;        // columns between two of the table's
constexpr int kUnbroken = 14;  // a cell of this width or less stays on one line: "188.9 N"
constexpr int kHeading = 9;    // a heading is broken from here on

struct ColumnWidth {
  int natural = 0;
  int least = 0;
};

int LongestWord(const std::string& text) {
  int longest = 0;
  for (const std::string& word : Split(text, ' ')) longest = std::max(longest, DisplayWidth(word));
  return longest;
}

std::vector<ColumnWidth> Measure(const std::vector<TableRow>& rows) {
  std::vector<ColumnWidth> widths(rows.front().size());
  for (size_t r = 0; r < rows.size(); ++r) {
    for (size_t i = 0; i < widths.size(); ++i) {
      const int natural = DisplayWidth(rows[r][i].text);
      const bool whole = natural <= (r == 0 ? kHeading : kUnbroken);
      widths[i].natural = std::max(widths[i].natural, natural);
      widths[i].least = std::max(widths[i].least, whole ? natural : LongestWord(rows[r][i].text));
    }
  }
  return widths;
}

int Total(const std::vector<int>& widths) {
  return std::accumulate(widths.begin(), widths.end(),
                         kGap * (static_cast<int>(widths.size()) - 1));
}

/// `text` with words longer than `width` in pieces.
std::string Broken(const std::string& text, int width) {
  std::string broken;
  int length = 0;  // of the word
  for (const char c : text) {
    const bool begins = (static_cast<unsigned char>(c) & 0xC0) != 0x80;  // a character of UTF-8
    length = c == ' ' ? 0 : length + (begins ? 1 : 0);
    if (length > width) {
      broken += ' ';
      length = 1;
    }
    broken += c;
  }
  return broken;
}

/// Widths of `columns` that fit, the widest shrunk first; below the least ones when these do not.
std::vector<int> Fit(const std::vector<ColumnWidth>& all, const std::vector<size_t>& columns,
                     int width) {
  std::vector<int> widths;
  for (const size_t i : columns) widths.push_back(all[i].natural);
  while (Total(widths) > width) {
    size_t widest = columns.size();
    for (size_t k = 0; k < columns.size(); ++k) {
      if (widths[k] <= all[columns[k]].least) continue;
      if (widest == columns.size() || widths[k] > widths[widest]) widest = k;
    }
    if (widest == columns.size()) {
      widest = static_cast<size_t>(std::ranges::max_element(widths) - widths.begin());
    }
    if (widths[widest] == 1) break;
    --widths[widest];
  }
  return widths;
}

std::string Block(const std::vector<TableRow>& rows, const std::vector<size_t>& columns,
                  const std::vector<int>& widths) {
  std::string text;
  for (size_t r = 0; r < rows.size(); ++r) {
    std::vector<std::vector<std::string>> cells;
    size_t height = 1;
    for (size_t k = 0; k < columns.size(); ++k) {
      cells.push_back(Split(Wrapped(Broken(rows[r][columns[k]].text, widths[k]), widths[k]), '\n'));
      height = std::max(height, cells.back().size());
    }
    for (size_t line = 0; line < height; ++line) {
      std::string joined;
      int pending = 0;  // spaces before the next text: none at the line's end
      for (size_t k = 0; k < columns.size(); ++k) {
        // A heading stands on the line below it.
        const size_t above = r == 0 ? height - cells[k].size() : 0;
        const bool has = line >= above && line - above < cells[k].size();
        const std::string part = has ? cells[k][line - above] : "";
        if (!part.empty()) {
          joined.append(static_cast<size_t>(pending), ' ');
          joined += Toned(part, r == 0 ? Tone::kStrong : rows[r][columns[k]].tone);
          pending = 0;
        }
        pending += widths[k] - DisplayWidth(part) + kGap;
      }
      text += joined + "\n";
    }
    if (r > 0) continue;
    std::string rule;
    for (size_t k = 0; k < columns.size(); ++k) {
      if (k > 0) rule += "  ";
      for (int i = 0; i < widths[k]; ++i) rule += "─";
    }
    rule.erase(rule.find_last_not_of(' ') + 1);
    text += rule + "\n";
  }
  return text;
}

}  // namespace

std::string FormatNumber(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) return fmt::format("{:.0f}", value);
  return std::abs(value) >= 1e4 ? fmt::format("{:.0f}", value) : fmt::format("{:.4g}", value);
}

std::string FormatNumber(double value, const std::string& unit) {
  return unit.empty() ? FormatNumber(value) : FormatNumber(value) + " " + unit;
}

std::string FormatColumns(std::vector<TableRow> rows, int width) {
  for (TableRow& row : rows) {
    for (TableCell& cell : row) cell.text = logging::ForTerminal(cell.text);
  }
  const std::vector<ColumnWidth> widths = Measure(rows);
  std::vector<std::vector<size_t>> blocks(1, {0});
  const auto least = [&](const std::vector<size_t>& columns) {
    std::vector<int> all;
    for (const size_t i : columns) all.push_back(widths[i].least);
    return Total(all);
  };
  for (size_t i = 1; i < widths.size(); ++i) {
    std::vector<size_t> wider = blocks.back();
    wider.push_back(i);
    if (wider.size() > 2 && least(wider) > width) {
      blocks.push_back({0, i});
    } else {
      blocks.back() = std::move(wider);
    }
  }
  std::string text;
  for (const std::vector<size_t>& columns : blocks) {
    if (!text.empty()) text += "\n";
    text += Block(rows, columns, Fit(widths, columns, width));
  }
  return text;
}

std::string CsvLine(const std::vector<std::string>& cells) {
  std::string line;
  for (const std::string& cell : cells) {
    if (&cell != &cells.front()) line += ',';
    line += CsvCell(cell);
  }
  return line + '\n';
}

}  // namespace poise
