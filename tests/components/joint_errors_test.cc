// What a leg's joints are wrong by, learnt while its foot hangs free: against drawn errors, and
// against a foot's force that is known to be zero.
#include "components/state_estimator/joint_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace poise {
namespace {

constexpr double kTick = 0.002;
const JointErrors::Torques kShare = {0.5, 0.02, 0.02};

struct Drawn {
  double squared = 0;   ///< (N·m)², mean of what is left of the errors
  double variance = 0;  ///< (N·m)², mean of what JointErrors says it is
};

/// Errors drawn as shares of `learnt`, learnt for `time` s with noise, then asked for at `asked`.
Drawn Draw(const JointErrors::Torques& learnt, const JointErrors::Torques& asked, double time) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Drawn result;
  constexpr int kTrials = 500;
  for (int trial = 0; trial < kTrials; ++trial) {
    JointErrors errors(1, kShare);
    double error = 0, then = 0, seen = 0, before = 0;
    for (size_t i = 0; i < kShare.size(); ++i) {
      const double share = kShare[i] * normal(random);
      error += share * learnt[i];
      then += share * asked[i];
      seen += std::pow(kShare[i] * learnt[i], 2);
      before += std::pow(kShare[i] * asked[i], 2);
    }
    for (double t = 0; t < time; t += kTick) {
      errors.Age(kTick);
      errors.Learn(0, learnt, error + 0.1 * normal(random), seen, false, kTick);
    }
    const JointErrors::Corrected corrected = errors.Correct(0, asked, before);
    result.squared += std::pow(then - corrected.error, 2) / kTrials;
    result.variance += corrected.variance / kTrials;
  }
  return result;
}

TEST(JointErrors, WhatIsLeftIsWhatTheVarianceSays) {
  const JointErrors::Torques swing = {2, 8, 10};
  const double before = std::pow(0.5 * 2, 2) + std::pow(0.02 * 8, 2) + std::pow(0.02 * 10, 2);
  // The same torques: nearly all of the error is known.
  const Drawn same = Draw(swing, swing, 1);
  EXPECT_LT(same.squared, 0.05 * before);
  EXPECT_LT(same.variance, 0.2 * before);
  EXPECT_GT(same.variance, same.squared);
  // Friction that has turned over: the error has changed its sign.
  const Drawn turned = Draw(swing, {-2, 8, 10}, 1);
  EXPECT_GT(turned.variance, 0.8 * before);
  // The mean of 500 squares of one normal number lies within 20 % (three deviations).
  EXPECT_LT(turned.squared, 1.2 * turned.variance);
  // A foot that stands, with torques ten times as large: hardly anything is known.
  const JointErrors::Torques stance = {2, 80, 60};
  const double standing = std::pow(0.5 * 2, 2) + std::pow(0.02 * 80, 2) + std::pow(0.02 * 60, 2);
  const Drawn stood = Draw(swing, stance, 1);
  EXPECT_LT(stood.variance, standing) << "friction is the same";
  EXPECT_LT(stood.squared, 1.2 * stood.variance);
}

TEST(JointErrors, WhatIsLearntIsForgotten) {
  JointErrors errors(2, kShare);
  const JointErrors::Torques swing = {2, 8, 10};
  EXPECT_EQ(errors.Correct(0, swing, 1).error, 0) << "nothing is learnt";
  EXPECT_EQ(errors.Correct(0, swing, 1).variance, 1);
  for (int i = 0; i < 500; ++i) errors.Learn(0, swing, 0.8, 1.1, false, kTick);
  const double soon = errors.Correct(0, swing, 1).error;
  EXPECT_NEAR(soon, 0.8, 0.1);
  EXPECT_EQ(errors.Correct(1, swing, 1).error, 0) << "another joint's";
  errors.Age(60);
  const JointErrors::Corrected late = errors.Correct(0, swing, 1);
  EXPECT_LT(late.error, 0.2 * soon);
  EXPECT_GT(late.variance, 0.8);
  errors.Begin(0);
  EXPECT_EQ(errors.Correct(0, swing, 1).error, 0);
}

// A load that comes slowly is not learnt: 15 N/s for 0.6 s, when the foot may be pressed.
TEST(JointErrors, AFootThatMayBePressedTeachesLittle) {
  const JointErrors::Torques swing = {2, 8, 10};
  JointErrors free(1, kShare), pressed(1, kShare);
  for (int i = 0; i < 500; ++i) {
    free.Learn(0, swing, 0, 1.1, false, kTick);
    pressed.Learn(0, swing, 0, 1.1, false, kTick);
  }
  for (int i = 0; i < 300; ++i) {
    free.Learn(0, swing, i / 300.0, 1.1, false, kTick);
    pressed.Learn(0, swing, i / 300.0, 1.1, true, kTick);
  }
  // First-order lags of a ramp of 1 N·m in T = 0.6 s: 1 − τ/T (1 − exp(−T/τ)) with τ 0.5 s and 5 s.
  // Noise and the average's ten independent readings take a tenth off.
  const double learnt = 1 - 0.5 / 0.6 * (1 - std::exp(-1.2));
  const double little = 1 - 5 / 0.6 * (1 - std::exp(-0.12));
  EXPECT_NEAR(free.Correct(0, swing, 1.1).error, 0.9 * learnt, 0.1 * learnt);
  EXPECT_NEAR(pressed.Correct(0, swing, 1.1).error, 0.9 * little, 0.1 * little);
}

TEST(FreeFoot, IsFreeOnceItMovesWithoutALoadAndUntilItIsPressed) {
  FreeFoot foot;
  const auto last = [&](double time, double speed, double excess, double press) {
    for (double t = 0; t < time; t += kTick) foot.Update(speed, excess, press, kTick);
    return foot.free();
  };
  EXPECT_FALSE(last(1, 0.001, 1, 0.5)) << "it stands, with hardly any load";
  EXPECT_FALSE(last(1, 0.2, 60, 8)) << "it slips under its load";
  EXPECT_FALSE(last(0.03, 0.2, 1, 0.5)) << "for a moment only";
  EXPECT_FALSE(last(0.1, 0.001, 1, 0.5));
  EXPECT_TRUE(last(0.1, 0.2, 1, 0.5));
  EXPECT_TRUE(last(5, 0, 1, -3)) << "it hovers";
  EXPECT_FALSE(last(0.01, 0.03, 30, 4)) << "it comes down";
  EXPECT_FALSE(last(5, 0, 1, 0.5)) << "it stands until it is lifted";
}

}  // namespace
}  // namespace poise
