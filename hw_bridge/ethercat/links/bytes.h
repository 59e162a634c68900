// Little-endian fields of EtherCAT frames, registers and mailboxes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace poise::ethercat {

/// The unsigned integer of `size` bytes (at most 8) at `offset`. Precondition: they lie inside
/// `bytes`.
inline uint64_t GetSized(std::span<const uint8_t> bytes, size_t offset, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; ++i) value |= uint64_t{bytes[offset + i]} << (8 * i);
  return value;
}

/// The integer T at `offset`. Precondition: it lies inside `bytes`.
template <class T>
T Get(std::span<const uint8_t> bytes, size_t offset) {
  return static_cast<T>(GetSized(bytes, offset, sizeof(T)));
}

/// Writes `value` as `size` bytes (at most 8) at `offset`. Precondition: they lie inside `bytes`.
inline void PutSized(std::span<uint8_t> bytes, size_t offset, uint64_t value, size_t size) {
  for (size_t i = 0; i < size; ++i) bytes[offset + i] = static_cast<uint8_t>(value >> (8 * i));
}

template <class T>
void Put(std::span<uint8_t> bytes, size_t offset, T value) {
  PutSized(bytes, offset, static_cast<uint64_t>(value), sizeof(T));
}

/// The unsigned integer of `size` bits (at most 64) from bit `first` on; a byte's lowest bit is its
/// first. Precondition: they lie inside `bytes`.
inline uint64_t GetBits(std::span<const uint8_t> bytes, size_t first, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; ++i) {
    const size_t bit = first + i;
    value |= uint64_t{static_cast<uint8_t>(bytes[bit / 8] >> (bit % 8) & 1)} << i;
  }
  return value;
}

/// Writes `value` likewise. Precondition: the bits are zero.
inline void PutBits(std::span<uint8_t> bytes, size_t first, uint64_t value, size_t size) {
  for (size_t i = 0; i < size; ++i) {
    const size_t bit = first + i;
    bytes[bit / 8] |= static_cast<uint8_t>((value >> i & 1) << (bit % 8));
  }
}

}  // namespace poise::ethercat
