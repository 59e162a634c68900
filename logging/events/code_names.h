// Words for the codes of messages.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>

namespace poise::logging {

struct CodeName {
  int8_t code;
  const char* name;
};

/// The name of `code`; of one that has none, "KIND CODE".
inline std::string NameOf(std::span<const CodeName> names, int8_t code, const char* kind) {
  const auto found = std::ranges::find(names, code, &CodeName::code);
  return found != names.end() ? found->name : kind + (" " + std::to_string(code));
}

}  // namespace poise::logging
