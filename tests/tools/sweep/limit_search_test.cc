// The search for limits on functions whose boundaries are known.
#include "tools/sweep/limit_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <random>

#include "tests/test_seed.h"

namespace poise {
namespace {

Limit MakeLimit(double min, double max, int samples, double tolerance) {
  Limit limit;
  limit.set_min(min);
  limit.set_max(max);
  limit.set_samples(samples);
  limit.set_tolerance(tolerance);
  return limit;
}

using Survives = std::function<std::optional<bool>(double)>;

/// Answers one wanted value after the other, picked by `pick`.
LimitSearch Search(const Limit& limit, const Survives& survives,
                   const std::function<size_t(size_t)>& pick) {
  LimitSearch search(limit);
  for (int i = 0; i < 1000; ++i) {
    const std::vector<double> wanted = search.Wanted();
    if (wanted.empty()) return search;
    const double value = wanted[pick(wanted.size())];
    search.Add(value, survives(value));
  }
  ADD_FAILURE() << "does not end";
  return search;
}

LimitSearch Search(const Limit& limit, const Survives& survives) {
  return Search(limit, survives, [](size_t) { return size_t{0}; });
}

TEST(LimitSearch, FindsAMonotoneBoundary) {
  const Limit limit = MakeLimit(0, 100, 11, 0.5);
  for (const double boundary : {3.0, 10.0, 37.2, 99.9}) {
    const LimitSearch search = Search(limit, [&](double x) { return x < boundary; });
    EXPECT_LT(*search.limit(), boundary);
    EXPECT_GE(*search.limit(), boundary - 0.5);
    EXPECT_GE(*search.fails_at(), boundary);
    EXPECT_LE(*search.fails_at() - *search.limit(), 0.5);
    EXPECT_EQ(search.monotone(), true);
    EXPECT_LE(search.tried(), LimitSearch::ExpectedRuns(limit));
  }
}

TEST(LimitSearch, TellsThatAllOrNothingIsSurvived) {
  const Limit limit = MakeLimit(1, 2, 5, 0.01);
  const LimitSearch all = Search(limit, [](double) { return true; });
  EXPECT_EQ(all.limit(), 2);
  EXPECT_FALSE(all.fails_at());
  EXPECT_EQ(all.monotone(), true);
  EXPECT_EQ(all.tried(), 5);
  const LimitSearch none = Search(limit, [](double) { return false; });
  EXPECT_FALSE(none.limit());
  EXPECT_EQ(none.fails_at(), 1);
  EXPECT_FALSE(none.largest_survived());
  EXPECT_EQ(none.monotone(), true);
}

// Survived below 42.3 and in an island from 55 to 78.4.
bool Island(double x) { return x < 42.3 || (x >= 55 && x < 78.4); }

TEST(LimitSearch, FindsBothEndsOfWhatIsNotMonotone) {
  const LimitSearch search = Search(MakeLimit(0, 100, 11, 0.1), Island);
  EXPECT_NEAR(*search.limit(), 42.3, 0.1);
  EXPECT_LT(*search.limit(), 42.3);
  EXPECT_NEAR(*search.fails_at(), 42.3, 0.1);
  EXPECT_NEAR(*search.largest_survived(), 78.4, 0.1);
  EXPECT_LT(*search.largest_survived(), 78.4);
  EXPECT_TRUE(search.survived_again());
}

TEST(LimitSearch, AnIslandAboveANothing) {
  const LimitSearch search =
      Search(MakeLimit(0, 100, 11, 0.1), [](double x) { return x > 25 && x < 61.7; });
  EXPECT_FALSE(search.limit());
  EXPECT_EQ(search.fails_at(), 0);
  EXPECT_NEAR(*search.largest_survived(), 61.7, 0.1);
  EXPECT_TRUE(search.survived_again());
}

TEST(LimitSearch, AGapBelowTheTop) {
  const LimitSearch search =
      Search(MakeLimit(0, 100, 11, 0.1), [](double x) { return x < 48 || x > 53; });
  EXPECT_NEAR(*search.limit(), 48, 0.1);
  EXPECT_EQ(search.largest_survived(), 100);  // nothing above is known
  EXPECT_TRUE(search.survived_again());
}

TEST(LimitSearch, AsksTheSameWhateverTheOrderOfAnswers) {
  Limit limit = MakeLimit(0, 100, 11, 0.1);
  limit.set_cap(300);
  const LimitSearch first = Search(limit, Island);
  std::mt19937 random(TestSeed(3));
  for (int i = 0; i < 100; ++i) {
    const LimitSearch other = Search(limit, Island, [&](size_t n) { return random() % n; });
    EXPECT_EQ(other.tried(), first.tried());
    EXPECT_EQ(other.limit(), first.limit());
    EXPECT_EQ(other.fails_at(), first.fails_at());
    EXPECT_EQ(other.largest_survived(), first.largest_survived());
  }
}

TEST(LimitSearch, ARunThatDoesNotTellMakesTheLimitUnknown) {
  const Limit limit = MakeLimit(0, 100, 11, 0.5);
  // Where bisection comes to between 40 and 50.
  const LimitSearch beside = Search(limit, [](double x) -> std::optional<bool> {
    if (x > 43 && x < 46) return {};
    return x < 45;
  });
  EXPECT_FALSE(beside.known());
  EXPECT_FALSE(beside.limit());
  EXPECT_FALSE(beside.fails_at());
  EXPECT_FALSE(beside.monotone());
  // Above the limit it leaves open whether something is survived again.
  const LimitSearch above = Search(limit, [](double x) -> std::optional<bool> {
    if (x == 80) return {};
    return x < 45;
  });
  EXPECT_TRUE(above.known());
  EXPECT_NEAR(*above.limit(), 45, 0.5);
  EXPECT_FALSE(above.monotone());
  EXPECT_FALSE(above.largest_survived());
}

TEST(LimitSearch, RaisesTheTopUntilSomethingFallsOrTheCapIsMet) {
  Limit limit = MakeLimit(0, 100, 11, 0.5);
  limit.set_cap(1000);
  for (const double boundary : {103.0, 250.0, 999.0}) {
    const LimitSearch search = Search(limit, [&](double x) { return x < boundary; });
    EXPECT_LT(*search.limit(), boundary);
    EXPECT_GE(*search.fails_at(), boundary);
    EXPECT_LE(*search.fails_at() - *search.limit(), 0.5);
  }
  const LimitSearch all = Search(limit, [](double) { return true; });
  EXPECT_EQ(all.limit(), 1000);
  EXPECT_FALSE(all.fails_at());
  // What falls below max is searched as without a cap.
  const LimitSearch low = Search(limit, [](double x) { return x < 37.2; });
  limit.clear_cap();
  EXPECT_EQ(low.tried(), Search(limit, [](double x) { return x < 37.2; }).tried());
}

TEST(LimitSearch, EndsAtAToleranceBelowWhatNumbersCanTell) {
  Limit limit = MakeLimit(1e15, 1e15 + 8, 3, 1e-3);
  const LimitSearch search = Search(limit, [](double x) { return x < 1e15 + 3; });
  EXPECT_LT(*search.limit(), 1e15 + 3);
  EXPECT_GE(*search.fails_at(), 1e15 + 3);
}

}  // namespace
}  // namespace poise
