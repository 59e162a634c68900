// The numbers and strings of an encoded message, as a list.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "lcmtypes/message_fields.h"

namespace poise {

struct MessageScalar {
  std::string path;  ///< as ScalarVisitor has it
  std::variant<int64_t, double, std::string> value;
};
/// In the order of declaration; empty when the bytes are not exactly one message of this type.
std::optional<std::vector<MessageScalar>> ScalarsOf(const MessageType& type,
                                                    std::span<const uint8_t> data);

/// Whether the bytes are exactly one message of this type, without a number that is not finite.
bool AllFinite(const MessageType& type, std::span<const uint8_t> data);

}  // namespace poise
