#include "hw_bridge/unitree/crc.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace poise::unitree {
namespace {

constexpr uint32_t kPolynomial = 0x04C11DB7;

constexpr std::array<uint32_t, 256> MakeTable() {
  std::array<uint32_t, 256> table{};
  for (uint32_t i = 0; i < table.size(); ++i) {
    uint32_t crc = i << 24;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc >> 31) != 0 ? kPolynomial : 0);
    table[i] = crc;
  }
  return table;
}

constexpr std::array<uint32_t, 256> kTable = MakeTable();

/// A message's words as it lies in memory, where each field is at a multiple of its size.
template <class T>
class Words {
 public:
  explicit Words(const T& message) {
    static_assert(offsetof(T, crc) + sizeof(uint32_t) == sizeof(T));
    std::memcpy(words_.data(), &message, sizeof(T));
  }
  /// Takes for 0 what fills up between two fields: bytes `first` up to `last`.
  void Clear(size_t first, size_t last) {
    std::memset(reinterpret_cast<std::byte*>(words_.data()) + first, 0, last - first);
  }
  /// Sums all words but the last, which has the sum.
  uint32_t Crc() const { return Crc32(std::span(words_).first(words_.size() - 1)); }

 private:
  std::array<uint32_t, sizeof(T) / sizeof(uint32_t)> words_;
};

static_assert(std::endian::native == std::endian::little,
              "the robots' check sum is that of a little-endian computer");

}  // namespace

uint32_t Crc32(std::span<const uint32_t> words) {
  uint32_t crc = 0xFFFFFFFF;
  for (const uint32_t word : words) {
    for (int shift = 24; shift >= 0; shift -= 8) {
      crc = (crc << 8) ^ kTable[(crc >> 24) ^ ((word >> shift) & 0xFF)];
    }
  }
  return crc;
}

uint32_t CrcOf(const LowCmd& command) {
  Words words(command);
  words.Clear(offsetof(LowCmd, mode_machine) + 1, offsetof(LowCmd, motor_cmd));
  for (size_t i = 0; i < kNumSlots; ++i) {
    const size_t motor = offsetof(LowCmd, motor_cmd) + i * sizeof(MotorCmd);
    words.Clear(motor + offsetof(MotorCmd, mode) + 1, motor + offsetof(MotorCmd, q));
  }
  return words.Crc();
}

uint32_t CrcOf(const LowState& state) {
  Words words(state);
  words.Clear(offsetof(LowState, mode_machine) + 1, offsetof(LowState, tick));
  const size_t imu = offsetof(LowState, imu_state);
  words.Clear(imu + offsetof(ImuState, temperature) + sizeof(int16_t), imu + sizeof(ImuState));
  for (size_t i = 0; i < kNumSlots; ++i) {
    const size_t motor = offsetof(LowState, motor_state) + i * sizeof(MotorState);
    words.Clear(motor + offsetof(MotorState, mode) + 1, motor + offsetof(MotorState, q));
  }
  return words.Crc();
}

}  // namespace poise::unitree
