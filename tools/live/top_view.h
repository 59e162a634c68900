// The view of `poise top`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"
#include "logging/element_names.h"
#include "tools/live/live_statistics.h"

namespace poise {

/// A line of printable ASCII, and how to show it where the terminal can.
struct ViewLine {
  enum class Style { kPlain, kTitle, kWarning, kFailure };
  std::string text;
  Style style = Style::kPlain;
  /// Where the columns of a table's row end; the first one stays in sight. Empty: no table.
  std::vector<size_t> ends = {};
};

/// Lines that stay at the top of a frame: what the run as a whole does.
inline constexpr size_t kTopHeader = 4;

/// How far a reader has gone in a view that is larger than the terminal.
struct ViewScroll {
  int line = 0;    ///< of those below the header, the first in sight
  int column = 0;  ///< characters of tables, behind their first column, that are out of sight

  /// Goes on by a key of FullScreen: k, j, b, f, g, G up and down; h, l to the sides.
  void Move(char key, int page);
};

/// The whole view, kTopHeader lines of header first, in tables the columns first by which a fault
/// is seen; `names`: of the run's robot, `dir`: the run's folder, `refused`: packets that
/// the listener refused.
std::vector<ViewLine> TopView(const RunSpec& spec, const logging::ElementNames& names,
                              const std::string& dir, const LiveSnapshot& snapshot,
                              int64_t refused);

/// Plain text, a line feed after each line. Columns that do not fit `width` come in further blocks
/// below, the first one again in each.
std::string PlainText(const std::vector<ViewLine>& lines, int width);

/// One frame for a terminal of this size, over the frame before: the header, what `scroll` says of
/// the rest, and a last line with the keys. `scroll` is kept within the view.
std::string Frame(const std::vector<ViewLine>& lines, int columns, int rows, ViewScroll* scroll);

}  // namespace poise
