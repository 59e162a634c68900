#include "hw_bridge/unitree/remote.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "hw_bridge/unitree/messages.h"

namespace poise::unitree {
namespace {

constexpr std::array<std::string_view, 16> kNames = {"R1", "L1",    "start", "select", "R2", "L2",
                                                     "F1", "F2",    "A",     "B",      "X",  "Y",
                                                     "up", "right", "down",  "left"};

}  // namespace

uint16_t Buttons(std::span<const uint8_t, 40> remote) {
  return static_cast<uint16_t>(remote[2] | (remote[3] << 8));
}

void SetButtons(uint16_t buttons, std::span<uint8_t, 40> remote) {
  remote[2] = static_cast<uint8_t>(buttons & 0xFF);
  remote[3] = static_cast<uint8_t>(buttons >> 8);
}

uint16_t ButtonsOf(const std::vector<std::string>& names) {
  unsigned bits = 0;
  for (const std::string& name : names) {
    const auto* const place = std::find(kNames.begin(), kNames.end(), name);
    if (place == kNames.end()) {
      throw UnitreeError("\"{}\" is no button of the remote; it has {}", name,
                         fmt::join(kNames, " "));
    }
    bits |= 1U << static_cast<unsigned>(place - kNames.begin());
  }
  return static_cast<uint16_t>(bits);
}

}  // namespace poise::unitree
