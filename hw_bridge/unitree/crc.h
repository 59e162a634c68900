// The check sum of commands and states.
#pragma once

#include <cstdint>
#include <span>

#include "hw_bridge/unitree/messages.h"

namespace poise::unitree {

/// CRC-32 with polynomial 0x04C11DB7, begun with 0xFFFFFFFF, of 32-bit words, each from its most
/// significant bit; neither reflected nor inverted.
uint32_t Crc32(std::span<const uint32_t> words);

/// Sums all but `crc`, as the message lies in memory; what C fills up between fields counts as 0.
uint32_t CrcOf(const LowCmd& command);
uint32_t CrcOf(const LowState& state);

}  // namespace poise::unitree
