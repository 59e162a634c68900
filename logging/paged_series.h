// Items by tick that stay in a file until they are asked for.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <utility>

#include "logging/paged_file.h"

namespace poise::logging {

/// Encoded items of one size in a file, and where each tick's stands. The last ones that were asked
/// for are held decoded. One thread at a time.
template <class T>
class PagedSeries {
 public:
  using Decode = std::function<void(std::span<const uint8_t>, T*)>;

  /// Throws LogError.
  PagedSeries(std::shared_ptr<PagedFile> bytes, Decode decode)
      : bytes_(std::move(bytes)), decode_(std::move(decode)), places_(PagedFile::Scratch()) {}

  /// The item of `tick` is what `decode` makes of the `size` bytes there, of every tick the same.
  void Place(int64_t tick, uint64_t offset, size_t size) {
    size_ = size;
    const uint64_t at = static_cast<uint64_t>(tick) * sizeof(uint64_t);
    if (at >= places_->size()) places_->Resize(at + sizeof(uint64_t));
    const uint64_t place = offset + 1;  // 0: none
    std::memcpy(places_->Writable(at), &place, sizeof(place));
    held_[Slot(tick)].tick = -1;
    empty_ = false;
  }
  /// nullptr when there is none of that tick. Valid until a tick kHeld or more away is asked for.
  const T* at(int64_t tick) {
    Held& held = held_[Slot(tick)];
    if (held.tick == tick && tick >= 0) return &held.item;
    const uint64_t at = static_cast<uint64_t>(tick) * sizeof(uint64_t);
    if (tick < 0 || at >= places_->size()) return nullptr;
    uint64_t place = 0;
    std::memcpy(&place, places_->At(at), sizeof(place));
    if (place == 0) return nullptr;
    decode_({bytes_->At(place - 1), size_}, &held.item);
    held.tick = tick;
    return &held.item;
  }
  bool empty() const { return empty_; }
  PagedFile& bytes() { return *bytes_; }

  static constexpr int64_t kHeld = 16;  ///< items

 private:
  struct Held {
    int64_t tick = -1;
    T item;
  };
  static size_t Slot(int64_t tick) { return static_cast<uint64_t>(tick) % kHeld; }

  std::shared_ptr<PagedFile> bytes_;
  Decode decode_;
  std::unique_ptr<PagedFile> places_;  // by tick: offset + 1
  size_t size_ = 0;                    // bytes an item
  bool empty_ = true;
  std::array<Held, kHeld> held_;
};

}  // namespace poise::logging
