// Which ticks a page shows one by one, and which by their least and largest values.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace poise::logging {

/// `count` rows of `stride` ticks each, from `first_tick` on; the last may hold fewer.
struct RowSpan {
  int64_t first_tick = 0;
  int64_t stride = 1;
  int64_t count = 0;
};

/// The ticks of a run in rows, without a gap, in order. Immutable.
class PageRows {
 public:
  /// A row a tick, of ticks [first, end).
  PageRows(int64_t first, int64_t end);
  /// Makes at most about `most_rows` rows. A tick has its own near those of `focus`, which come in
  /// order of importance, and near both ends; elsewhere a row has as many ticks as it takes. Where
  /// all ticks fit, each has a row. `period`: of a tick, s.
  PageRows(int64_t first, int64_t end, int64_t most_rows, double period,
           std::span<const int64_t> focus);

  const std::vector<RowSpan>& spans() const { return spans_; }
  int64_t size() const { return size_; }  ///< rows
  bool every_tick() const { return every_tick_; }
  /// How many of `focus` found no room for their surroundings.
  int64_t left_out() const { return left_out_; }
  /// The row of a tick; -1: it is not in one. `stride`: its row's.
  int64_t RowOf(int64_t tick, int64_t* stride) const;

 private:
  void AddSpan(int64_t first, int64_t end, int64_t stride);

  std::vector<RowSpan> spans_;
  std::vector<int64_t> first_rows_;  // by span
  int64_t end_ = 0;                  // first tick after the rows
  int64_t size_ = 0;
  bool every_tick_ = true;
  int64_t left_out_ = 0;
};

}  // namespace poise::logging
