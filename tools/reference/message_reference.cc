#include "tools/reference/message_reference.h"

#include <algorithm>
#include <regex>
#include <sstream>

#include "components/framework/configuration.h"
#include "components/framework/suggest.h"
#include "fmt/format.h"

namespace poise {

std::string_view EmbeddedMessages();  // all .lcm files, one after the other

namespace {

constexpr std::string_view kFileStart = "package poise;";

/// The entry of one file; its package line is gone.
MessageEntry ParseFile(std::string_view file) {
  MessageEntry entry;
  std::istringstream lines{std::string(file)};
  std::string line;
  bool in_struct = false;
  while (std::getline(lines, line)) {
    if (line.starts_with("//") && !in_struct) {
      if (!entry.summary.empty()) entry.summary += ' ';
      entry.summary.append(line, line.find_first_not_of("/ "));
    }
    if (line.starts_with("struct ")) {
      in_struct = true;
      entry.type = line.substr(7, line.find_first_of(" {", 7) - 7);
    }
    if (in_struct) entry.definition += line + "\n";
    if (line.starts_with("}")) break;
  }
  return entry;
}

}  // namespace

std::vector<MessageEntry> MessageReference() {
  std::vector<MessageEntry> messages;
  std::string_view rest = EmbeddedMessages();
  while (!rest.empty()) {
    rest.remove_prefix(std::min(rest.find(kFileStart), rest.size()));
    if (rest.empty()) break;
    rest.remove_prefix(kFileStart.size());
    messages.push_back(ParseFile(rest.substr(0, rest.find(kFileStart))));
  }
  std::sort(messages.begin(), messages.end(),
            [](const auto& a, const auto& b) { return a.type < b.type; });
  for (MessageEntry& message : messages) {
    for (const MessageEntry& other : messages) {
      const std::regex field(fmt::format("\\n\\s*{}\\s", other.type));
      if (std::regex_search(message.definition, field)) message.nested.push_back(other.type);
    }
  }
  return messages;
}

const MessageEntry& FindMessage(const std::vector<MessageEntry>& messages, std::string_view name) {
  std::vector<std::string> names;
  for (const MessageEntry& message : messages) {
    if (message.type == name || message.type == std::string(name) + "_t") return message;
    names.push_back(message.type);
  }
  throw ConfigError(fmt::format("there is no message or channel '{}'; {}", name,
                                Suggest(name, std::move(names))));
}

}  // namespace poise
