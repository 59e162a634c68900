// What many files do with lists and texts.
#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace poise {

template <class Value, class List>
bool IsAmong(const Value& value, const List& list) {
  return std::ranges::find(list, value) != std::ranges::end(list);
}

/// The names of a message's elements, in their order.
template <class List>
std::vector<std::string> NamesOf(const List& list) {
  std::vector<std::string> names;
  for (const auto& each : list) names.push_back(each.name());
  return names;
}

/// The number that the whole text is; empty: it is none.
template <class Number>
std::optional<Number> NumberIn(std::string_view text) {
  Number number{};
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc() && end == last ? std::optional(number) : std::nullopt;
}

/// "a", "b", "" of "a,b," and ','.
inline std::vector<std::string> Split(std::string_view text, char at) {
  std::vector<std::string> parts;
  while (true) {
    const size_t end = text.find(at);
    parts.emplace_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

/// "a, b, c" of {"a", "b", "c"} and ", ". Not fmt::join, which GCC 12 misreads in some callers.
inline std::string Joined(const std::vector<std::string>& parts, std::string_view separator) {
  std::string text;
  for (const std::string& part : parts) {
    if (!text.empty()) text += separator;
    text += part;
  }
  return text;
}

/// "step needed" of "step_needed".
inline std::string Spaced(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

/// `word` as a POSIX shell reads it back: quoted where that is needed.
inline std::string ShellWord(const std::string& word) {
  if (!word.empty() && word.find_first_of(" \t\n'\"$&|;<>()[]{}*?!#~`\\") == std::string::npos) {
    return word;
  }
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace poise
