// A condition with hysteresis in time: neither noise nor the number of ticks decides.
#include "components/framework/tick_time.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/test_seed.h"

namespace poise {
namespace {

TEST(HeldCondition, ChangesOnceItIsContradictedForTheDuration) {
  HeldCondition condition;
  EXPECT_FALSE(condition.Update(0.0, false, 0.02));
  EXPECT_FALSE(condition.Update(0.010, true, 0.02));
  EXPECT_FALSE(condition.Update(0.028, true, 0.02));
  EXPECT_TRUE(condition.Update(0.030, true, 0.02));
  EXPECT_TRUE(condition.Update(0.040, false, 0.02));
  EXPECT_TRUE(condition.Update(0.058, false, 0.02));
  EXPECT_FALSE(condition.Update(0.060, false, 0.02));
}

TEST(HeldCondition, OneContraryTickBeginsAnew) {
  HeldCondition condition;
  EXPECT_FALSE(condition.Update(0.00, true, 0.02));
  EXPECT_FALSE(condition.Update(0.018, true, 0.02));
  EXPECT_FALSE(condition.Update(0.019, false, 0.02));
  EXPECT_FALSE(condition.Update(0.020, true, 0.02));
  EXPECT_FALSE(condition.Update(0.038, true, 0.02));
  EXPECT_TRUE(condition.Update(0.040, true, 0.02));
}

TEST(HeldCondition, ASparseClockSwitchesAtMostOneIntervalLater) {
  for (const double period : {0.001, 0.002, 0.007}) {
    HeldCondition condition;
    double on = -1;
    for (int i = 0; on < 0 && i < 1000; ++i) {
      if (condition.Update(i * period, i * period >= 0.1, 0.02)) on = i * period;
    }
    EXPECT_GE(on, 0.12 - 1e-9);
    EXPECT_LE(on, 0.12 + 2 * period);
  }
}

TEST(HeldCondition, NoiseAboutTheEdgeRaisesNoAlarm) {
  HeldCondition condition;
  std::mt19937 random(TestSeed(1));
  std::normal_distribution<double> noise(0, 0.005);
  for (int i = 0; i < 100000; ++i) {
    // Inside by two deviations: one sample of 40 is outside, ten in a row never.
    ASSERT_FALSE(condition.Update(0.002 * i, 0.01 + noise(random) < 0, 0.02));
  }
}

}  // namespace
}  // namespace poise
