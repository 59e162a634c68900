// Every message of the bus, as its .lcm file tells it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace poise {

struct MessageEntry {
  std::string type;                 ///< "robot_state_t"
  std::string summary;              ///< the comment above the struct, one line
  std::string definition;           ///< the struct with its comments, as in lcmtypes/
  std::vector<std::string> nested;  ///< types of its fields that have entries of their own
};

/// By type. Types that are only fields of others are among them.
std::vector<MessageEntry> MessageReference();

/// The entry of the type "robot_state_t" or "robot_state". Throws ConfigError with near names when
/// there is none.
const MessageEntry& FindMessage(const std::vector<MessageEntry>& messages, std::string_view name);

}  // namespace poise
