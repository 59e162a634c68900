#include "hw_bridge/unitree/crc.h"

#include <array>
#include <bit>
#include <boost/crc.hpp>
#include <boost/endian/conversion.hpp>
#include <cstddef>
#include <cstring>

namespace poise::unitree {
namespace {

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
  boost::crc_optimal<32, 0x04C11DB7, 0xFFFFFFFF, 0, false, false> crc;
  for (const uint32_t word : words) {
    const uint32_t from_the_top = boost::endian::endian_reverse(word);
    crc.process_bytes(&from_the_top, sizeof from_the_top);
  }
  return crc.checksum();
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
