#include "components/state_estimator/low_pass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace poise {
namespace {

// Against the transfer function of the second-order Butterworth filter.
TEST(LowPass, HasTheGainAndPhaseOfAButterworthFilter) {
  constexpr double kCutoff = 20, kStep = 1e-4;
  for (const double frequency : {2.0, 10.0, 20.0, 40.0, 100.0}) {
    LowPass filter(1, kCutoff);
    const double r = frequency / kCutoff;
    const double gain = 1 / std::sqrt(1 + r * r * r * r);
    const double phase = -std::atan2(std::numbers::sqrt2 * r, 1 - r * r);
    for (int i = 1; i < 20000; ++i) {
      // The input is held over the step: its value in the middle.
      filter.Step(Eigen::VectorXd::Constant(
                      1, std::sin(2 * std::numbers::pi * frequency * (i - 0.5) * kStep)),
                  kStep);
      if (i < 10000) continue;
      const double expected = gain * std::sin(2 * std::numbers::pi * frequency * i * kStep + phase);
      ASSERT_NEAR(filter.value()[0], expected, 2e-3 * gain) << frequency;
    }
  }
}

TEST(LowPass, IsStableAndUnbiasedForAnyStep) {
  for (const double step : {1e-5, 0.002, 0.02, 1.0, 100.0}) {
    LowPass filter(2, 20);
    for (int i = 0; i < 200000; ++i) filter.Step(Eigen::Vector2d(1, -3), step);
    EXPECT_NEAR(filter.value()[0], 1, 1e-2) << step;
    EXPECT_NEAR(filter.value()[1], -3, 3e-2) << step;
  }
}

}  // namespace
}  // namespace poise
