// How two encoded messages of one type differ.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "poise/message_traits.hpp"

namespace poise::logging {

/// True when both are the same bytes apart from run_id.
bool SameBits(const MessageType& type, std::span<const uint8_t> a, std::span<const uint8_t> b);

struct ScalarDifference {
  std::string path;   ///< "torque[3]"
  std::string first;  ///< all digits
  std::string second;
  double size = 0;  ///< absolute; infinite when one is not finite; 1 for texts
};

/// Scalars with other bits, in order, run_id aside; empty optional when one is not such a message
/// or they have other counts.
std::optional<std::vector<ScalarDifference>> DifferingScalars(const MessageType& type,
                                                              std::span<const uint8_t> a,
                                                              std::span<const uint8_t> b);

}  // namespace poise::logging
