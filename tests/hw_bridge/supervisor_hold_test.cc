// Commands that are lost and come back: holding, its end, and torque without a jump.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/hw_bridge/supervisor_fixture.h"

namespace poise {
namespace {

using Status = bridge_status_t;

SupervisorConfig Holding() {
  SupervisorConfig config = ThreeJoints();
  config.settings.set_on_lost_command(HwBridgeConfig::HOLD);
  config.settings.set_hold_time(0.2);  // 100 cycles
  config.thresholds.hold_stiffness.assign(config.motors.size(), 600);
  config.thresholds.hold_damping.assign(config.motors.size(), 10);
  config.resume_time = 0.02;  // 10 cycles
  return config;
}

TEST(SupervisorHold, KeepsTheLastTorqueWhereNothingMoves) {
  Bench bench(Holding());
  bench.Run(10, 20, 0);
  for (int age = 1; age <= 103; ++age) {
    bench.Step(nullptr);
    ASSERT_EQ(bench.status().state, age <= 3 ? Status::STATE_RUNNING : Status::STATE_HOLDING);
    ASSERT_DOUBLE_EQ(bench.status().applied_torque[0], 20) << age;
  }
  EXPECT_EQ(bench.status().reason, Status::REASON_NO_COMMAND);
  bench.Step(nullptr);  // 100 cycles of holding are over
  EXPECT_EQ(bench.status().state, Status::STATE_DAMPING);
  for (int i = 0; i < 13; ++i) bench.Step(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_STOPPING);
}

TEST(SupervisorHold, IsASpringAndADamperAboutTheLoss) {
  Bench bench(Holding());
  bench.Run(10, 20, 0);
  for (int i = 0; i < 4; ++i) bench.Step(nullptr);
  ASSERT_EQ(bench.status().state, Status::STATE_HOLDING);
  // 50 cycles at 0.2 rad/s: 0.02 rad; the velocity filter (2.7 ms) has settled.
  for (int i = 0; i < 50; ++i) bench.Step(nullptr, 0.2);
  EXPECT_NEAR(bench.status().applied_torque[0], 20 - 600 * 0.02 - 10 * 0.2, 0.1);
  bench.Step(nullptr, 0);
  for (int i = 0; i < 20; ++i) bench.Step(nullptr, 0);
  EXPECT_NEAR(bench.status().applied_torque[0], 20 - 600 * 0.02, 0.1);
}

TEST(SupervisorHold, RespectsTheLimits) {
  Bench bench(Holding());
  bench.Run(10, 20, 0);
  for (int i = 0; i < 4; ++i) bench.Step(nullptr);
  for (int i = 0; i < 80; ++i) bench.Step(nullptr, -3);  // 0.48 rad: 288 N·m of spring
  for (size_t j = 0; j < kJoints; ++j) {
    EXPECT_DOUBLE_EQ(bench.drives().current[j], kCurrentLimit[j]);
    EXPECT_EQ(bench.status().saturated[j], Status::LIMIT_TORQUE);
  }
}

TEST(SupervisorHold, ACommandThatIsBackIsFadedIn) {
  Bench bench(Holding());
  bench.Run(10, 20, 0);
  for (int i = 0; i < 30; ++i) bench.Step(nullptr);
  ASSERT_EQ(bench.status().state, Status::STATE_HOLDING);
  double before = bench.status().applied_torque[0];
  for (int i = 1; i <= 10; ++i) {
    bench.Step(64.0);
    ASSERT_EQ(bench.status().state, Status::STATE_RUNNING);
    // Straight from 20 to 64 N·m in eleven equal steps.
    EXPECT_NEAR(bench.status().applied_torque[0] - before, 4, 1e-9) << i;
    before = bench.status().applied_torque[0];
  }
  bench.Step(64.0);
  EXPECT_DOUBLE_EQ(bench.status().applied_torque[0], 64);
}

TEST(SupervisorHold, ALossWhileACommandIsFadedInHoldsWhatWasApplied) {
  Bench bench(Holding());
  bench.Run(10, 20, 0);
  for (int i = 0; i < 30; ++i) bench.Step(nullptr);
  bench.Step(64.0);
  for (int i = 0; i < 3; ++i) bench.Step(nullptr);
  const double applied = bench.status().applied_torque[0];
  bench.Step(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_HOLDING);
  EXPECT_DOUBLE_EQ(bench.status().applied_torque[0], applied);
}

TEST(SupervisorHold, RefusedCommandsAreLostOnes) {
  Bench bench(Holding());
  bench.Run(10, 20, 0);
  for (int i = 0; i < 4; ++i) bench.Step(kNan);
  EXPECT_EQ(bench.status().state, Status::STATE_HOLDING);
  EXPECT_EQ(bench.status().reason, Status::REASON_COMMAND_NOT_FINITE);
}

TEST(SupervisorHold, AFaultWhileHoldingStops) {
  Bench bench(Holding());
  bench.Run(10, 20, 0);
  for (int i = 0; i < 10; ++i) bench.Step(nullptr);
  bench.feedback().drive_status[2] = drive_feedback_t::DRIVE_FAULT;
  bench.Step(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_STOPPING);
  EXPECT_EQ(bench.status().reason_joint, 2);
}

TEST(SupervisorHold, WithoutFeedbackTheSpringKeepsItsLastLength) {
  Bench bench(Holding());
  bench.Run(10, 20, 0);
  for (int i = 0; i < 4; ++i) bench.Step(nullptr);
  for (int i = 0; i < 50; ++i) bench.Step(nullptr, 0.2);
  bench.End(nullptr);
  EXPECT_NEAR(bench.status().applied_torque[0], 20 - 600 * 0.02, 0.1);
}

SupervisorConfig HoldingFromTheStart() {
  SupervisorConfig config = Holding();
  config.settings.set_hold_before_command(true);
  config.start_velocity = 0.5;
  return config;
}

TEST(SupervisorHold, WithoutItMotorsAreFreeUntilTheFirstCommand) {
  Bench bench(Holding());
  for (int i = 0; i < 20; ++i) {
    bench.Step(nullptr);
    ASSERT_EQ(bench.status().state, Status::STATE_INIT);
    ASSERT_TRUE(bench.AllFree());
  }
}

TEST(SupervisorHold, BeforeTheFirstCommandIsASpringAboutTheStartForAsLongAsItTakes) {
  Bench bench(HoldingFromTheStart());
  for (int i = 0; i < 1000; ++i) {  // ten times hold_time
    bench.Step(nullptr);
    ASSERT_EQ(bench.status().state, Status::STATE_HOLDING);
    ASSERT_EQ(bench.status().reason, Status::REASON_NO_COMMAND);
    ASSERT_EQ(bench.drives().enabled[0], 1);
    ASSERT_DOUBLE_EQ(bench.status().applied_torque[0], 0);
  }
  // 50 cycles at 0.2 rad/s: 0.02 rad from where it started.
  for (int i = 0; i < 50; ++i) bench.Step(nullptr, 0.2);
  EXPECT_NEAR(bench.status().applied_torque[0], -600 * 0.02 - 10 * 0.2, 0.1);
  bench.Step(nullptr, 0);
  for (int i = 0; i < 20; ++i) bench.Step(nullptr, 0);
  EXPECT_NEAR(bench.status().applied_torque[0], -600 * 0.02, 0.1);
}

TEST(SupervisorHold, FadesInTheFirstCommandAndThenKnowsALossLikeAnyOther) {
  Bench bench(HoldingFromTheStart());
  for (int i = 0; i < 10; ++i) bench.Step(nullptr);
  for (int i = 1; i <= 11; ++i) {
    bench.Step(22, 0);
    ASSERT_EQ(bench.status().state, Status::STATE_RUNNING);
    ASSERT_NEAR(bench.status().applied_torque[0], 22.0 * i / 11, 1e-9);
  }
  for (int i = 0; i < 4; ++i) bench.Step(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_HOLDING);
  EXPECT_NEAR(bench.status().applied_torque[0], 22, 1e-9);
  for (int i = 0; i < 100; ++i) bench.Step(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_DAMPING);
}

TEST(SupervisorHold, FromTheStartWaitsUntilItKnowsWhereTheJointsAre) {
  Bench bench(HoldingFromTheStart());
  for (int i = 0; i < 5; ++i) {
    bench.End(nullptr);  // a cycle without feedback
    ASSERT_EQ(bench.status().state, Status::STATE_INIT);
    ASSERT_EQ(bench.status().reason, Status::REASON_START_POSITION);
    ASSERT_TRUE(bench.AllFree());
  }
  bench.Step(nullptr, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_HOLDING);
}

}  // namespace
}  // namespace poise
