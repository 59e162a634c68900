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

/// The words of a message as a computer of the robot's kind lays it out: little-endian, each field
/// at a multiple of its size.
class Words {
 public:
  template <class T>
  void Add(T value) {
    position_ = (position_ + sizeof(T) - 1) / sizeof(T) * sizeof(T);
    std::memcpy(&bytes_[position_], &value, sizeof(T));
    position_ += sizeof(T);
  }
  template <class T, size_t N>
  void Add(const T (&values)[N]) {
    for (const T& value : values) Add(value);
  }
  /// Goes on to a multiple of four bytes, where a structure ends.
  void FillUp() { position_ = (position_ + 3) / 4 * 4; }
  uint32_t Crc() {
    FillUp();
    std::array<uint32_t, kMost / 4> words;
    std::memcpy(words.data(), bytes_.data(), position_);
    return Crc32(std::span(words).first(position_ / 4));
  }

 private:
  static constexpr size_t kMost = sizeof(LowState);
  std::array<uint8_t, kMost> bytes_{};
  size_t position_ = 0;
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
  Words words;
  words.Add(command.mode_pr);
  words.Add(command.mode_machine);
  for (const MotorCmd& motor : command.motor_cmd) {
    words.FillUp();
    words.Add(motor.mode);
    for (const float value : {motor.q, motor.dq, motor.tau, motor.kp, motor.kd}) words.Add(value);
    words.Add(motor.reserve);
  }
  words.Add(command.reserve);
  return words.Crc();
}

uint32_t CrcOf(const LowState& state) {
  Words words;
  words.Add(state.version);
  words.Add(state.mode_pr);
  words.Add(state.mode_machine);
  words.Add(state.tick);
  words.Add(state.imu_state.quaternion);
  words.Add(state.imu_state.gyroscope);
  words.Add(state.imu_state.accelerometer);
  words.Add(state.imu_state.rpy);
  words.Add(state.imu_state.temperature);
  for (const MotorState& motor : state.motor_state) {
    words.FillUp();
    words.Add(motor.mode);
    for (const float value : {motor.q, motor.dq, motor.ddq, motor.tau_est}) words.Add(value);
    words.Add(motor.temperature);
    words.Add(motor.vol);
    words.Add(motor.sensor);
    words.Add(motor.motorstate);
    words.Add(motor.reserve);
  }
  words.Add(state.wireless_remote);
  words.Add(state.reserve);
  return words.Crc();
}

}  // namespace poise::unitree
