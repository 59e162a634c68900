#include "tools/reference/message_reference.h"

#include <algorithm>
#include <sstream>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "components/framework/configuration/text_pattern.h"
#include "fmt/format.h"
#include "lcmtypes/field_table.h"

namespace poise {

namespace {

/// The entry of one file; its package line is gone.
MessageEntry ParseFile(std::string_view file) {
  MessageEntry entry;
  std::istringstream lines{std::string(file)};
  std::string line;
  std::string prefix;
  bool in_struct = false;
  while (std::getline(lines, line)) {
    if (line.starts_with("package ")) {
      const std::string package = line.substr(8, line.find(';') - 8);
      if (package != "poise") prefix = package + ".";
      continue;
    }
    if (line.starts_with("//") && !in_struct) {
      if (!entry.summary.empty()) entry.summary += ' ';
      entry.summary.append(line, line.find_first_not_of("/ "));
    }
    if (line.starts_with("struct ")) {
      in_struct = true;
      entry.type = prefix + line.substr(7, line.find_first_of(" {", 7) - 7);
    }
    if (in_struct) entry.definition += line + "\n";
    if (line.starts_with("}")) break;
  }
  return entry;
}

}  // namespace

std::vector<MessageEntry> MessageReference() {
  std::vector<MessageEntry> messages;
  for (const std::string_view file : MessageDefinitions()) messages.push_back(ParseFile(file));
  std::ranges::sort(messages, [](const auto& a, const auto& b) { return a.type < b.type; });
  for (MessageEntry& message : messages) {
    const std::string package = message.type.substr(0, message.type.find('.') + 1);  // of poise ""
    for (const MessageEntry& other : messages) {
      const std::string name =  // within a package without it
          other.type.starts_with(package) ? other.type.substr(package.size()) : other.type;
      const std::string field = fmt::format("\\n\\s*{}\\s", name);
      if (!Matches(message.definition, field).empty()) message.nested.push_back(other.type);
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
