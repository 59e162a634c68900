#include "tools/reference/reference_text.h"

#include <algorithm>
#include <cctype>

#include "fmt/format.h"
#include "tools/cli/lists.h"

namespace poise {
namespace {

/// Columns of a UTF-8 text: its code points.
size_t Columns(std::string_view text) {
  return static_cast<size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string ChannelsOf(const MessageEntry& message, const ChannelsByType& channels) {
  const auto found = channels.find(message.type);
  return found == channels.end() ? "" : Joined(found->second, ", ");
}

/// Whether a comment says itself what holds without a value: "Default: that of the robot".
bool TellsDefault(std::string_view meaning) {
  return meaning.find("efault:") != std::string_view::npos;
}

/// Up to the first full stop before a capital: "e.g. 7.2" goes on.
std::string FirstSentence(const std::string& text) {
  for (size_t at = 0; (at = text.find(". ", at)) != std::string::npos; ++at) {
    if (at + 2 < text.size() && std::isupper(static_cast<unsigned char>(text[at + 2])) != 0) {
      return text.substr(0, at + 1);
    }
  }
  return text;
}

/// A cell of a Markdown table.
std::string Cell(std::string text) {
  for (size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) {
    text.insert(at, 1, '\\');
  }
  return text;
}

}  // namespace

std::string Wrapped(std::string_view text, size_t width, size_t indent) {
  std::string result;
  size_t column = 0;
  while (!text.empty()) {
    const size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (word.empty()) continue;
    if (column > indent && column + 1 + Columns(word) > width) {
      result += '\n';
      column = 0;
    }
    result += column == 0 ? std::string(indent, ' ') : " ";
    column = (column == 0 ? indent : column + 1) + Columns(word);
    result += word;
  }
  if (!result.empty()) result += '\n';
  return result;
}

std::string FieldsAsText(const std::vector<FieldEntry>& fields, size_t width) {
  std::string text;
  for (const FieldEntry& field : fields) {
    text += fmt::format("{}: {}", field.path, field.type);
    if (!field.range.empty()) text += fmt::format(", {}", field.range);
    if (!field.default_value.empty()) {
      text += fmt::format(", default {}", field.default_value);
    } else if (!field.group && !TellsDefault(field.meaning)) {
      text += ", no default";
    }
    text += '\n';
    text += Wrapped(field.meaning, width, 4);
    for (const auto& [name, meaning] : field.values) {
      text += Wrapped(fmt::format("{}{}{}", name, meaning.empty() ? "" : ": ", meaning), width, 6);
    }
  }
  return text;
}

std::string FieldIndex(const std::vector<FieldEntry>& fields, size_t width) {
  constexpr size_t kColumn = 28;
  const auto first_name = [](const FieldEntry& field) {
    return field.path.substr(0, field.path.find_first_of(".["));
  };
  std::string text;
  for (size_t i = 0; i < fields.size();) {
    const FieldEntry& first = fields[i];
    const std::string name = first_name(first);
    size_t count = 0, end = i;
    for (; end < fields.size() && first_name(fields[end]) == name; ++end) {
      count += fields[end].group ? 0 : 1;
    }
    const bool alone = end == i + 1 && !first.group;
    const std::string line =
        Wrapped((alone ? "" : fmt::format("{} fields. ", count)) + FirstSentence(first.meaning),
                width, kColumn);
    // A field without a comment has no line.
    text += fmt::format("{:<{}}{}", name, kColumn, line.empty() ? "\n" : line.substr(kColumn));
    i = end;
  }
  return text;
}

std::string FieldsAsMarkdown(const std::vector<FieldEntry>& fields) {
  std::string text;
  const std::string heading =
      "\n| field | type | default | unit | meaning |\n|---|---|---|---|---|\n";
  // The scalar fields of a group first, then the groups in it.
  const auto section = [&](const std::string& prefix) {
    std::string rows;
    for (const FieldEntry& field : fields) {
      if (field.group || !field.path.starts_with(prefix)) continue;
      if (field.path.find('.', prefix.size()) != std::string::npos) continue;
      std::string meaning = field.meaning;
      for (const auto& [name, value] : field.values) {
        meaning += fmt::format("<br>`{}`{}{}", name, value.empty() ? "" : ": ", value);
      }
      rows +=
          fmt::format("| `{}` | {}{} | {} | {} | {} |\n", field.path, field.type,
                      field.range.empty() ? "" : ", " + field.range,
                      field.default_value.empty() ? "" : fmt::format("`{}`", field.default_value),
                      Cell(field.unit), Cell(meaning));
    }
    if (!rows.empty()) text += heading + rows;
  };
  section("");
  for (const FieldEntry& field : fields) {
    if (!field.group) continue;
    text += fmt::format("\n## `{}`\n\n{}\n", field.path, field.meaning);
    section(field.path + ".");
  }
  return text;
}

std::string MessagesAsText(const std::vector<MessageEntry>& messages,
                           const ChannelsByType& channels, size_t width) {
  std::string text;
  for (const MessageEntry& message : messages) {
    const std::string names = ChannelsOf(message, channels);
    text += fmt::format("{}{}{}\n", message.type, names.empty() ? "" : ": ", names);
    text += Wrapped(message.summary, width, 4);
  }
  return text;
}

std::string MessageAsText(const std::vector<MessageEntry>& messages, const MessageEntry& message,
                          const ChannelsByType& channels, size_t width) {
  std::string text =
      fmt::format("{}\n{}", MessagesAsText({message}, channels, width), message.definition);
  for (const std::string& type : message.nested) {
    const MessageEntry& nested = FindMessage(messages, type);
    text += fmt::format("\n{}\n{}", MessagesAsText({nested}, channels, width), nested.definition);
  }
  return text;
}

std::string MessagesAsMarkdown(const std::vector<MessageEntry>& messages,
                               const ChannelsByType& channels) {
  std::string text;
  for (const MessageEntry& message : messages) {
    const std::string names = ChannelsOf(message, channels);
    text += fmt::format("\n## `{}`\n\n{}{}\n\n```c\n{}```\n", message.type,
                        names.empty() ? "" : fmt::format("Channel {}. ", names), message.summary,
                        message.definition);
  }
  return text;
}

}  // namespace poise
