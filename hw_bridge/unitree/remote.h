// The wireless remote, as 40 bytes of each state carry it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace poise::unitree {

/// Bits of pressed buttons in the order R1 L1 start select R2 L2 F1 F2 A B X Y up right down left:
/// bytes 2 and 3 after the head, the low one first.
uint16_t Buttons(std::span<const uint8_t, 40> remote);
/// Presses those buttons and no other.
void SetButtons(uint16_t buttons, std::span<uint8_t, 40> remote);
/// Bits of buttons by name. Throws UnitreeError naming one that is none.
uint16_t ButtonsOf(const std::vector<std::string>& names);

}  // namespace poise::unitree
