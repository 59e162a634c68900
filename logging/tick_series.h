// Items by tick, in memory or in a file.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

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

/// Items of some ticks, in memory or, once Page was called, in a file. In memory a tick without
/// one, between the first and the last that have one, takes four bytes, whatever T is.
template <class T>
class Series {
 public:
  /// nullptr when there is none of that tick. Valid until the next Set and, in a file, until a tick
  /// PagedSeries::kHeld or more away is asked for, of this series or a copy.
  const T* at(int64_t tick) const {
    if (paged_) return paged_->at(tick);
    if (tick < first_ || tick - first_ >= std::ssize(index_)) return nullptr;
    const int32_t item = index_[static_cast<size_t>(tick - first_)];
    return item < 0 ? nullptr : &items_[static_cast<size_t>(item)];
  }
  /// `tick` from 0 on.
  void Set(int64_t tick, T item) {
    if (index_.empty()) first_ = tick;
    if (tick < first_) {
      // The index grows by as much again, so that ticks in falling order do not move it every time.
      const int64_t more = std::min(first_, std::max(first_ - tick, std::ssize(index_)));
      index_.insert(index_.begin(), static_cast<size_t>(more), -1);
      first_ -= more;
    }
    const auto i = static_cast<size_t>(tick - first_);
    if (i >= index_.size()) index_.resize(i + 1, -1);
    if (index_[i] >= 0) {
      items_[static_cast<size_t>(index_[i])] = std::move(item);
    } else {
      index_[i] = static_cast<int32_t>(items_.size());
      items_.push_back(std::move(item));
    }
  }
  bool empty() const { return paged_ ? paged_->empty() : items_.empty(); }
  /// From now on `paged` has the items. Precondition: the series is empty.
  void Page(std::shared_ptr<PagedSeries<T>> paged) { paged_ = std::move(paged); }

 private:
  std::shared_ptr<PagedSeries<T>> paged_;  // nullptr: in memory
  std::vector<T> items_;
  int64_t first_ = 0;           // tick of index_[0]
  std::vector<int32_t> index_;  // into items_; -1: none
};

}  // namespace poise::logging
