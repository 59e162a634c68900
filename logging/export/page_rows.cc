#include "logging/export/page_rows.h"

#include <algorithm>
#include <cmath>

namespace poise::logging {
namespace {

// What a page shows tick by tick around an event: what led to it, and what it led to.
constexpr double kBefore = 0.1;      // s
constexpr double kAfter = 0.3;       // s
constexpr double kFocusShare = 0.6;  // of the rows, at most

struct Window {
  int64_t first;
  int64_t end;
};

/// Adds [first, end) and joins what touches. Ticks that were not there before.
int64_t Join(Window window, std::vector<Window>* windows) {
  std::vector<Window> joined;
  int64_t held = 0;
  for (const Window& each : *windows) {
    if (each.end < window.first || each.first > window.end) {
      joined.push_back(each);
      continue;
    }
    held += each.end - each.first;
    window = {std::min(window.first, each.first), std::max(window.end, each.end)};
  }
  joined.push_back(window);
  *windows = std::move(joined);
  return window.end - window.first - held;
}

}  // namespace

PageRows::PageRows(int64_t first, int64_t end) : end_(first) { AddSpan(first, end, 1); }

PageRows::PageRows(int64_t first, int64_t end, int64_t most_rows, double period,
                   std::span<const int64_t> focus)
    : end_(first) {
  if (end - first <= most_rows) {
    AddSpan(first, end, 1);
    return;
  }
  every_tick_ = false;
  const auto before = static_cast<int64_t>(std::llround(kBefore / period));
  const auto after = static_cast<int64_t>(std::llround(kAfter / period));
  auto room = static_cast<int64_t>(kFocusShare * static_cast<double>(most_rows));
  std::vector<Window> windows;
  const auto add = [&](int64_t tick) {
    std::vector<Window> with = windows;
    const int64_t more = Join({std::max(first, tick - before), std::min(end, tick + after)}, &with);
    if (more > room) return false;
    room -= more;
    windows = std::move(with);
    return true;
  };
  add(first);
  add(end - after);
  for (const int64_t tick : focus) {
    if (tick >= first && tick < end && !add(tick)) ++left_out_;
  }
  std::ranges::sort(windows, {}, &Window::first);
  int64_t detailed = 0;
  for (const Window& window : windows) detailed += window.end - window.first;
  const int64_t rows = std::max<int64_t>(1, most_rows - detailed);
  const int64_t stride = std::max<int64_t>(2, (end - first - detailed + rows - 1) / rows);
  for (const Window& window : windows) {
    AddSpan(end_, window.first, stride);
    AddSpan(end_, window.end, 1);
  }
  AddSpan(end_, end, stride);
}

void PageRows::AddSpan(int64_t first, int64_t end, int64_t stride) {
  if (end <= first) return;
  spans_.push_back({first, stride, (end - first + stride - 1) / stride});
  first_rows_.push_back(size_);
  size_ += spans_.back().count;
  end_ = end;
}

int64_t PageRows::RowOf(int64_t tick, int64_t* stride) const {
  const auto after = std::ranges::upper_bound(spans_, tick, {}, &RowSpan::first_tick);
  if (after == spans_.begin() || tick >= end_) return -1;
  const RowSpan& span = *(after - 1);
  *stride = span.stride;
  return first_rows_[static_cast<size_t>(after - 1 - spans_.begin())] +
         (tick - span.first_tick) / span.stride;
}

}  // namespace poise::logging
