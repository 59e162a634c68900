// When a step is said to be needed: neither noise nor the number of ticks decides.
#include "components/step_planner/contact/step_detector.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/test_seed.h"

namespace poise {
namespace {

TEST(StepDetector, NeedsTheMarginToStayOutsideForThePersistence) {
  StepDetector detector(0.01, 0.02);
  EXPECT_FALSE(detector.Update(0.0, -0.009));
  EXPECT_FALSE(detector.Update(0.010, -0.011));
  EXPECT_FALSE(detector.Update(0.028, -0.011));
  EXPECT_TRUE(detector.Update(0.030, -0.011));
  EXPECT_TRUE(detector.Update(0.040, 0.05));
  EXPECT_TRUE(detector.Update(0.058, 0.05));
  EXPECT_FALSE(detector.Update(0.060, 0.05));
}

TEST(StepDetector, OneSampleInsideBeginsAnew) {
  StepDetector detector(0, 0.02);
  EXPECT_FALSE(detector.Update(0.00, -1));
  EXPECT_FALSE(detector.Update(0.018, -1));
  EXPECT_FALSE(detector.Update(0.019, 1));
  EXPECT_FALSE(detector.Update(0.020, -1));
  EXPECT_FALSE(detector.Update(0.038, -1));
  EXPECT_TRUE(detector.Update(0.040, -1));
}

TEST(StepDetector, ASparseClockSwitchesAtMostOneIntervalLater) {
  for (const double period : {0.001, 0.002, 0.007}) {
    StepDetector detector(0, 0.02);
    double on = -1;
    for (int i = 0; on < 0 && i < 1000; ++i) {
      if (detector.Update(i * period, i * period < 0.1 ? 0.05 : -0.05)) on = i * period;
    }
    EXPECT_GE(on, 0.12 - 1e-9);
    EXPECT_LE(on, 0.12 + 2 * period);
  }
}

TEST(StepDetector, NoiseAboutTheEdgeRaisesNoAlarm) {
  StepDetector detector(0, 0.02);
  std::mt19937 random(TestSeed(1));
  std::normal_distribution<double> noise(0, 0.005);
  for (int i = 0; i < 100000; ++i) {
    // Inside by two deviations: one sample of 40 is outside, ten in a row never.
    ASSERT_FALSE(detector.Update(0.002 * i, 0.01 + noise(random)));
  }
}

}  // namespace
}  // namespace poise
