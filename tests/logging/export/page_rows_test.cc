#include "logging/export/page_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/test_seed.h"

namespace poise::logging {
namespace {

constexpr double kPeriod = 0.002;  // s

/// Each tick of [first, end) is in one row, rows in order; spans without gaps.
void ExpectCover(const PageRows& rows, int64_t first, int64_t end) {
  int64_t next = first, row = 0;
  for (size_t i = 0; i < rows.spans().size(); ++i) {
    const RowSpan& span = rows.spans()[i];
    ASSERT_EQ(span.first_tick, next);
    const int64_t stop = i + 1 < rows.spans().size() ? rows.spans()[i + 1].first_tick : end;
    for (int64_t k = 0; k < span.count; ++k, ++row) {
      const int64_t until = std::min(next + span.stride, stop);
      ASSERT_GT(until, next);
      for (; next < until; ++next) {
        int64_t stride = 0;
        ASSERT_EQ(rows.RowOf(next, &stride), row);
        ASSERT_EQ(stride, span.stride);
      }
    }
  }
  EXPECT_EQ(next, end);
  EXPECT_EQ(row, rows.size());
  int64_t stride = 0;
  EXPECT_EQ(rows.RowOf(first - 1, &stride), -1);
  EXPECT_EQ(rows.RowOf(end, &stride), -1);
}

TEST(PageRows, ARowIsATickWhereAllFit) {
  for (const int64_t end : {7, 8, 500}) {
    const PageRows rows(7, end, 500, kPeriod, {});
    EXPECT_TRUE(rows.every_tick());
    EXPECT_EQ(rows.size(), end - 7);
    ExpectCover(rows, 7, end);
  }
}

TEST(PageRows, EveryTickIsInOneRowAndRowsAreBounded) {
  std::mt19937 random(TestSeed(1));
  for (int trial = 0; trial < 50; ++trial) {
    const int64_t first = std::uniform_int_distribution<int64_t>(0, 1000)(random);
    const int64_t end = first + std::uniform_int_distribution<int64_t>(2000, 200'000)(random);
    const int64_t most = std::uniform_int_distribution<int64_t>(1000, 1900)(random);
    std::vector<int64_t> focus(std::uniform_int_distribution<size_t>(0, 20)(random));
    for (int64_t& tick : focus) {
      tick = std::uniform_int_distribution<int64_t>(first - 10, end + 10)(random);
    }
    const PageRows rows(first, end, most, kPeriod, focus);
    EXPECT_FALSE(rows.every_tick());
    // A row more for each stretch that does not end with a whole row.
    EXPECT_LE(rows.size(), most + static_cast<int64_t>(rows.spans().size()));
    ExpectCover(rows, first, end);
    const auto detailed = [&](int64_t tick) {
      int64_t stride = 0;
      return rows.RowOf(tick, &stride) >= 0 && stride == 1;
    };
    EXPECT_TRUE(detailed(first));
    EXPECT_TRUE(detailed(end - 1));
    const int64_t inside =
        std::ranges::count_if(focus, [&](int64_t tick) { return tick >= first && tick < end; });
    const int64_t shown = std::ranges::count_if(focus, detailed);
    EXPECT_GE(shown, inside - rows.left_out());
    if (!focus.empty() && focus[0] >= first && focus[0] < end) {
      EXPECT_TRUE(detailed(focus[0]));  // the most important one
    }
  }
}

}  // namespace
}  // namespace poise::logging
