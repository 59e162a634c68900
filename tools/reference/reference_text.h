// The references as text for a terminal and as Markdown.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tools/reference/message_reference.h"
#include "tools/reference/schemas.h"

namespace poise {

/// `text` in lines of at most `width` columns (UTF-8), each after `indent` spaces; a longer word
/// has a line of its own.
std::string Wrapped(std::string_view text, size_t width, size_t indent);

/// Two or more lines a field: path, type, default and unit; below it the meaning.
std::string FieldsAsText(const std::vector<FieldEntry>& fields, size_t width);
/// A line for each name on the first level: how many fields it has, and what they are for.
std::string FieldIndex(const std::vector<FieldEntry>& fields, size_t width);
/// A section for each group, a row a field.
std::string FieldsAsMarkdown(const std::vector<FieldEntry>& fields);

/// By message type: the channels of deploy/graphs that carry it.
using ChannelsByType = std::map<std::string, std::vector<std::string>>;

/// One paragraph a message.
std::string MessagesAsText(const std::vector<MessageEntry>& messages,
                           const ChannelsByType& channels, size_t width);
/// The whole of one message, and of the types of its fields.
std::string MessageAsText(const std::vector<MessageEntry>& messages, const MessageEntry& message,
                          const ChannelsByType& channels, size_t width);
std::string MessagesAsMarkdown(const std::vector<MessageEntry>& messages,
                               const ChannelsByType& channels);

}  // namespace poise
