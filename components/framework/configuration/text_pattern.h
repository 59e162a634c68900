// Regular expressions of ECMAScript's kind. They stand behind one file, since whoever includes
// <regex> compiles all of it.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace poise {

struct PatternPart {
  size_t begin = 0;  ///< in the text
  std::string text;  ///< empty for a group that took no part
};

/// What fits a pattern: the whole, then each group.
using PatternMatch = std::vector<PatternPart>;

/// Every match of `pattern` in `text`, in turn. Throws std::exception: `pattern` is none.
std::vector<PatternMatch> Matches(const std::string& text, const std::string& pattern);

/// `text` with `with` in place of each match, where $1 is the first group. Throws likewise.
std::string WithReplaced(const std::string& text, const std::string& pattern,
                         const std::string& with);

}  // namespace poise
