#include "tools/reference/value_names.h"

#include <cstdlib>
#include <map>

#include "components/framework/configuration/text_pattern.h"
#include "fmt/format.h"
#include "lcmtypes/field_table.h"

namespace poise {
namespace {

using Names = std::map<int64_t, std::string>;

/// By field of one message; `text` is its .lcm file.
std::map<std::string, Names, std::less<>> NamesIn(const std::string& text) {
  constexpr char kField[] =
      R"([\w.]+\s+(\w+)(?:\[\w+\])?;[ \t]*//[^\n]*?\b([A-Z]+(?:_[A-Z]+)*_)\*)";
  const std::vector<PatternMatch> constants =
      Matches(WithReplaced(text, R"(//[^\n]*)", ""), R"(([A-Z][A-Z0-9_]*)\s*=\s*(-?\d+))");
  std::map<std::string, Names, std::less<>> names;
  for (const PatternMatch& field : Matches(text, kField)) {
    const std::string& prefix = field[2].text;
    for (const PatternMatch& constant : constants) {
      const std::string& name = constant[1].text;
      if (!name.starts_with(prefix)) continue;
      names[field[1].text].emplace(std::atoll(constant[2].text.c_str()),
                                   name.substr(prefix.size()));
    }
  }
  return names;
}

}  // namespace

std::string ValueName(std::string_view type, std::string_view path, int64_t value) {
  // Read once: a stream of messages asks for each of them.
  static std::map<std::string, std::map<std::string, Names, std::less<>>, std::less<>> known;
  auto found = known.find(type);
  if (found == known.end()) {
    const size_t dot = type.rfind('.');
    const std::string_view name = type.substr(dot == std::string_view::npos ? 0 : dot + 1);
    const std::string package(dot == std::string_view::npos ? "poise" : type.substr(0, dot));
    std::string text;
    for (const std::string_view file : MessageDefinitions()) {
      const bool here = file.find(fmt::format("package {};", package)) != std::string_view::npos;
      const std::string pattern = fmt::format(R"(struct\s+{}\b)", name);
      if (here && !Matches(std::string(file), pattern).empty()) text = file;
    }
    found = known.emplace(std::string(type), NamesIn(text)).first;
  }
  const auto field = found->second.find(path.substr(0, path.find_first_of(".[")));
  if (field == found->second.end() || path.find('.') != std::string_view::npos) return "";
  const auto name = field->second.find(value);
  return name == field->second.end() ? "" : name->second;
}

}  // namespace poise
