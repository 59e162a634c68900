#include "components/framework/configuration/text_pattern.h"

#include <regex>

namespace poise {

std::vector<PatternMatch> Matches(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<PatternMatch> matches;
  for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it) {
    PatternMatch& match = matches.emplace_back();
    for (size_t i = 0; i < it->size(); ++i) {
      match.push_back({static_cast<size_t>(it->position(i)), it->str(i)});
    }
  }
  return matches;
}

std::string WithReplaced(const std::string& text, const std::string& pattern,
                         const std::string& with) {
  return std::regex_replace(text, std::regex(pattern), with);
}

}  // namespace poise
