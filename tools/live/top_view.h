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
};

/// The whole view; `names`: of the run's robot, `dir`: the run's folder, `refused`: packets that
/// the listener refused.
std::vector<ViewLine> TopView(const RunSpec& spec, const logging::ElementNames& names,
                              const std::string& dir, const LiveSnapshot& snapshot,
                              int64_t refused);

/// Plain text, a line feed after each line.
std::string PlainText(const std::vector<ViewLine>& lines);

/// One frame for a terminal of this size, over the frame before; blank lines go first when there
/// are too many, then what does not fit.
std::string Frame(const std::vector<ViewLine>& lines, int columns, int rows);

}  // namespace poise
