// Items by tick.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "logging/paged_series.h"

namespace poise::logging {

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
