// Little-endian fields of EtherCAT frames, registers and mailboxes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace poise::ethercat {

/// The integer T at `offset`. Precondition: it lies inside `bytes`.
template <class T>
T Get(std::span<const uint8_t> bytes, size_t offset) {
  uint64_t value = 0;
  for (size_t i = 0; i < sizeof(T); ++i) value |= uint64_t{bytes[offset + i]} << (8 * i);
  return static_cast<T>(static_cast<std::make_unsigned_t<T>>(value));
}

/// Writes `value` as `size` bytes (at most 8) at `offset`. Precondition: they lie inside `bytes`.
inline void PutSized(std::span<uint8_t> bytes, size_t offset, uint64_t value, size_t size) {
  for (size_t i = 0; i < size; ++i) bytes[offset + i] = static_cast<uint8_t>(value >> (8 * i));
}

template <class T>
void Put(std::span<uint8_t> bytes, size_t offset, T value) {
  PutSized(bytes, offset, static_cast<uint64_t>(value), sizeof(T));
}

/// The unsigned integer of `size` bytes (at most 8) at `offset`.
inline uint64_t GetSized(std::span<const uint8_t> bytes, size_t offset, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; ++i) value |= uint64_t{bytes[offset + i]} << (8 * i);
  return value;
}

}  // namespace poise::ethercat
