#include "components/balance/joint_limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/balance/balance_test_support.h"
#include "tests/test_seed.h"

namespace poise::balance {
namespace {

constexpr JointRange kRange{.lower = -1, .upper = 0.5, .velocity = 2, .acceleration = 10};

// A point mass that stops with A from the velocity v needs v²/(2 A): closed form.
double StoppingWay(double velocity) { return velocity * velocity / (2 * kRange.acceleration); }

TEST(ViableAccelerations, FarFromLimitsIsAllThatTheJointCan) {
  const AccelerationRange range = ViableAccelerations(kRange, -0.2, 0, 0.02);
  EXPECT_EQ(range.upper, kRange.acceleration);
  EXPECT_EQ(range.lower, -kRange.acceleration);
}

TEST(ViableAccelerations, AtTheEdgeOfViabilityIsTheStopItself) {
  for (const double speed : {0.3, 1.0, 1.9}) {
    const double at = kRange.upper - StoppingWay(speed);
    EXPECT_NEAR(ViableAccelerations(kRange, at, speed, 1e-3).upper, -kRange.acceleration, 1e-6);
    const double below = kRange.lower + StoppingWay(speed);
    EXPECT_NEAR(ViableAccelerations(kRange, below, -speed, 1e-3).lower, kRange.acceleration, 1e-6);
  }
}

TEST(ViableAccelerations, AtTheVelocityLimitNothingMoreIsGiven) {
  EXPECT_NEAR(ViableAccelerations(kRange, -0.9, kRange.velocity, 0.02).upper, 0, 1e-12);
  EXPECT_NEAR(ViableAccelerations(kRange, -0.9, 1.9, 0.02).upper, 5, 1e-12);  // 0.1 rad/s in 20 ms
}

TEST(ViableAccelerations, LostStatesAreStopped) {
  const AccelerationRange range = ViableAccelerations(kRange, 0.7, 1, 0.02);
  EXPECT_EQ(range.upper, -kRange.acceleration);
  EXPECT_LE(range.lower, range.upper);
}

// Whatever is asked for: held over the horizon, no joint that begins in a viable state leaves its
// range.
TEST(ViableAccelerations, NoRequestDrivesAJointOut) {
  std::mt19937_64 random(TestSeed(41));
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double horizon = 0.02;
  for (int run = 0; run < 200; ++run) {
    double velocity = kRange.velocity * uniform(random);
    double position = -0.25 + 0.7 * uniform(random);
    if (velocity > 0) position = std::min(position, kRange.upper - StoppingWay(velocity));
    if (velocity < 0) position = std::max(position, kRange.lower + StoppingWay(velocity));
    const double bias = 30 * uniform(random);
    for (int i = 0; i < 300; ++i) {
      const AccelerationRange range = ViableAccelerations(kRange, position, velocity, horizon);
      const double asked = bias + 60 * uniform(random);
      const double a = std::clamp(asked, range.lower, range.upper);
      position += horizon * velocity + 0.5 * horizon * horizon * a;
      velocity += horizon * a;
      ASSERT_LE(position, kRange.upper + 1e-9) << run << " " << i;
      ASSERT_GE(position, kRange.lower - 1e-9) << run << " " << i;
      ASSERT_LE(std::abs(velocity), kRange.velocity + 1e-9) << run << " " << i;
    }
  }
}

TEST(JointLimits, KeepAReserveOfWhatTheUrdfGives) {
  const auto model = Humanoid();
  const JointLimits limits(*model, 0.04);
  ASSERT_EQ(limits.num_joints(), model->num_joints());
  for (int j = 0; j < model->num_joints(); ++j) {
    const robot::Joint& joint = model->joints()[static_cast<size_t>(j)];
    if (std::isfinite(joint.upper - joint.lower)) {
      EXPECT_GT(limits.range(j).lower, joint.lower);
      EXPECT_LT(limits.range(j).upper, joint.upper);
    } else {  // continuous
      EXPECT_EQ(limits.Accelerations(j, 100, 0).upper, limits.range(j).acceleration);
    }
    EXPECT_LT(limits.range(j).velocity, joint.velocity_limit);
    EXPECT_GT(limits.range(j).acceleration, 0);
    EXPECT_LE(limits.range(j).acceleration, JointLimits::kHardest);
  }
}

// A joint of a leg that stands, at rest beyond its range, may stay there, may come back, and goes
// no further.
TEST(JointLimits, AStandingLegsJointIsStoppedAndNotBroughtBack) {
  const auto model = Humanoid();
  const JointLimits limits(*model, 0.04);
  for (int j = 0; j < model->num_joints(); ++j) {
    const JointRange& range = limits.range(j);
    if (!std::isfinite(range.upper - range.lower)) continue;
    for (const double side : {1.0, -1.0}) {
      const double limit = side > 0 ? range.upper : range.lower, beyond = limit + 0.02 * side;
      const auto outward = [&](const AccelerationRange& a) {
        return side > 0 ? a.upper : -a.lower;
      };
      EXPECT_LT(outward(limits.Accelerations(j, beyond, 0)), -1);
      EXPECT_NEAR(outward(limits.Stopping(j, beyond, 0)), 0, 1e-12);
      // What moves outward is stopped as at the limit itself.
      EXPECT_EQ(outward(limits.Stopping(j, beyond, 0.3 * side)),
                outward(limits.Accelerations(j, limit, 0.3 * side)));
      EXPECT_LT(outward(limits.Stopping(j, beyond, 0.3 * side)), -1);
    }
    const double middle = 0.5 * (range.lower + range.upper);
    EXPECT_EQ(limits.Stopping(j, middle, 0.1).upper, limits.Accelerations(j, middle, 0.1).upper);
  }
}

}  // namespace
}  // namespace poise::balance
