// What a message holds a zero for because it has nothing to tell.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lcmtypes/message_fields.h"

namespace poise::logging {

/// An encoded message with NaN for each number that is none: the wrench of a sensor that is not
/// good, what a command of torques alone leaves zero, a covariance that there is not, a step that
/// none is needed of, a temperature that no drive reports. `data` itself where all of it is told,
/// else `buffer`. `data` must be of `type`, well formed.
std::span<const uint8_t> WithoutUntold(const MessageType& type, std::span<const uint8_t> data,
                                       std::vector<uint8_t>* buffer);

}  // namespace poise::logging
