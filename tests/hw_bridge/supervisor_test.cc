#include "hw_bridge/supervisor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/hw_bridge/supervisor_fixture.h"

namespace poise {
namespace {

using Status = bridge_status_t;

// The gear and motor of the paper's robot: 50 × 0.1 N·m/A.
TEST(Units, TorqueOfTheRatedCurrentIs75NewtonMetres) {
  const robot::MotorModel motor = ThreeJoints().motors[0];
  EXPECT_DOUBLE_EQ(JointTorque(motor, 15), 75);
  EXPECT_DOUBLE_EQ(MotorCurrent(motor, 75), 15);
}

TEST(Units, FiftyMotorTurnsAreOneJointTurn) {
  const robot::MotorModel motor = ThreeJoints().motors[0];
  EXPECT_EQ(EncoderCounts(motor, 2 * std::numbers::pi), 50 * 8192);
  EXPECT_EQ(EncoderCounts(motor, -std::numbers::pi / 2), -50 * 8192 / 4);
  EXPECT_NEAR(JointPositionOf(motor, 50 * 8192 / 8), std::numbers::pi / 4, 1e-15);
}

TEST(Units, CountsAreRoundedToTheNearest) {
  const robot::MotorModel motor = ThreeJoints().motors[0];
  const double one_count = 2 * std::numbers::pi / (50 * 8192);
  EXPECT_EQ(EncoderCounts(motor, 3.4 * one_count), 3);
  EXPECT_EQ(EncoderCounts(motor, -3.6 * one_count), -4);
}

TEST(Supervisor, MotorsAreFreeUntilTheFirstAcceptedCommand) {
  Bench bench;
  for (int i = 0; i < 100; ++i) {
    bench.Step(nullptr, 3.0);
    ASSERT_TRUE(bench.AllFree());
    ASSERT_EQ(bench.status().state, Status::STATE_INIT);
    ASSERT_EQ(bench.status().reason, Status::REASON_NO_COMMAND);
  }
  bench.Step(kNan);
  EXPECT_TRUE(bench.AllFree());
  EXPECT_EQ(bench.status().state, Status::STATE_INIT);
  EXPECT_EQ(bench.status().reason, Status::REASON_COMMAND_NOT_FINITE);
}

TEST(Supervisor, CurrentIsTorqueOverGearAndTorqueConstant) {
  Bench bench;
  bench.Step(10.0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
  EXPECT_EQ(bench.status().reason, Status::REASON_NONE);
  EXPECT_DOUBLE_EQ(bench.drives().current[0], 10 / (50 * 0.1));
  EXPECT_DOUBLE_EQ(bench.drives().current[2], 10 / (100 * 0.05));
  for (size_t j = 0; j < kJoints; ++j) {
    EXPECT_EQ(bench.drives().enabled[j], 1);
    EXPECT_EQ(bench.status().applied_torque[j], 10);
    EXPECT_EQ(bench.status().saturated[j], 0);
  }
}

TEST(Supervisor, SaturatesAtEffortOrPeakCurrentWhicheverIsLess) {
  Bench bench;
  bench.Step(1000.0);
  // Effort 100 N·m; peak current 30 A; peak current 4 A.
  EXPECT_DOUBLE_EQ(bench.drives().current[0], 20);
  EXPECT_DOUBLE_EQ(bench.drives().current[1], 30);
  EXPECT_DOUBLE_EQ(bench.drives().current[2], 4);
  EXPECT_DOUBLE_EQ(bench.status().applied_torque[1], 150);
  EXPECT_EQ(bench.status().saturations, 3);
  bench.Step(-120.0);
  EXPECT_DOUBLE_EQ(bench.drives().current[0], -20);
  EXPECT_DOUBLE_EQ(bench.drives().current[1], -24);
  EXPECT_DOUBLE_EQ(bench.drives().current[2], -4);
  EXPECT_EQ(bench.status().saturated[0], 1);
  EXPECT_EQ(bench.status().saturated[1], 0);
  EXPECT_EQ(bench.status().saturations, 5);
}

TEST(Supervisor, HoldsTheLastCommandThenDampsThenStops) {
  Bench bench;
  bench.Run(100, 10, 0.5);  // long enough for the velocity filter to settle
  for (int age = 1; age <= 3; ++age) {
    bench.Step(nullptr, 0.5);
    EXPECT_EQ(bench.status().state, Status::STATE_RUNNING) << age;
    EXPECT_EQ(bench.status().command_age, age);
    EXPECT_DOUBLE_EQ(bench.drives().current[0], 2) << age;
  }
  for (int age = 4; age <= 16; ++age) {
    bench.Step(nullptr, 0.5);
    ASSERT_EQ(bench.status().state, Status::STATE_DAMPING) << age;
    EXPECT_EQ(bench.status().reason, Status::REASON_NO_COMMAND);
    // −20 N·m·s/rad × 0.5 rad/s = −10 N·m; one count of the encoder is 0.008 rad/s in a cycle.
    EXPECT_NEAR(bench.drives().current[0], -10 / 5.0, 0.03);
    EXPECT_EQ(bench.drives().enabled[0], 1);
  }
  double previous = kInfinity;
  for (int i = 0; i < 50; ++i) {  // 0.1 s of ramp
    bench.Step(nullptr, 0.5);
    ASSERT_EQ(bench.status().state, Status::STATE_STOPPING);
    EXPECT_EQ(bench.drives().enabled[0], 1);
    const double expected = 2.0 * (50 - i) / 50;
    EXPECT_NEAR(-bench.drives().current[0], expected, 0.03) << i;
    EXPECT_LT(-bench.drives().current[0], previous + 0.03);
    previous = -bench.drives().current[0];
  }
  for (int i = 0; i < 1000; ++i) {
    bench.Step(10.0, 0.5);  // commands no longer help
    ASSERT_TRUE(bench.AllFree());
    ASSERT_EQ(bench.status().state, Status::STATE_STOPPED);
    ASSERT_EQ(bench.status().reason, Status::REASON_NO_COMMAND);
  }
}

TEST(Supervisor, ACommandDuringDampingResumes) {
  Bench bench;
  bench.Step(10.0);
  for (int i = 0; i < 10; ++i) bench.Step(nullptr);
  ASSERT_EQ(bench.status().state, Status::STATE_DAMPING);
  bench.Step(5.0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
  EXPECT_EQ(bench.status().reason, Status::REASON_NONE);
  EXPECT_DOUBLE_EQ(bench.drives().current[0], 1);
}

TEST(Supervisor, DampingOpposesTheMotionAndRespectsTheLimits) {
  Bench bench;
  bench.Run(100, 0, -40);  // −20 × −40 = 800 N·m, far above every limit
  for (int i = 0; i < 5; ++i) bench.Step(nullptr, -40);
  ASSERT_EQ(bench.status().state, Status::STATE_DAMPING);
  for (size_t j = 0; j < kJoints; ++j) {
    EXPECT_DOUBLE_EQ(bench.drives().current[j], kCurrentLimit[j]);
  }
}

struct RefusalCase {
  const char* name;
  std::function<void(joint_command_t*)> spoil;
  int8_t reason;
  int64_t bridge_status_t::*counter;
};

class Refuses : public testing::TestWithParam<RefusalCase> {};

// A command refused forever is a command missing: held, damped, stopped, and the reason says why.
TEST_P(Refuses, AndTreatsItAsMissing) {
  Bench bench;
  bench.Run(20, 10, 0);
  int64_t refused = 0;
  while (bench.status().state != Status::STATE_STOPPING) {
    joint_command_t command = Command(bench.cycle(), 50);
    GetParam().spoil(&command);
    bench.Step(&command);
    ++refused;
    ASSERT_LE(refused, 17);
    ASSERT_EQ(bench.status().*GetParam().counter, refused);
    ASSERT_EQ(bench.status().command_age, refused);
    const double expected = bench.status().state == Status::STATE_RUNNING ? 2 : 0;
    ASSERT_NEAR(bench.drives().current[0], expected, 1e-12);
    ASSERT_EQ(bench.status().state == Status::STATE_RUNNING, refused <= 3);
    if (refused > 3) {
      ASSERT_EQ(bench.status().reason, GetParam().reason);
    }
  }
  EXPECT_EQ(refused, 17);
  EXPECT_EQ(bench.status().refused_not_finite + bench.status().refused_stale +
                bench.status().refused_sequence + bench.status().refused_size +
                bench.status().refused_run,
            refused);
}

INSTANTIATE_TEST_SUITE_P(
    Command, Refuses,
    testing::Values(
        RefusalCase{"Nan", [](joint_command_t* c) { c->torque[1] = kNan; },
                    Status::REASON_COMMAND_NOT_FINITE, &Status::refused_not_finite},
        RefusalCase{"Infinite", [](joint_command_t* c) { c->torque[2] = -kInfinity; },
                    Status::REASON_COMMAND_NOT_FINITE, &Status::refused_not_finite},
        RefusalCase{"Held",
                    [](joint_command_t* c) { c->status = joint_command_t::STATUS_INVALID_INPUT; },
                    Status::REASON_COMMAND_STALE, &Status::refused_stale},
        RefusalCase{"OfTheFuture", [](joint_command_t* c) { c->tick += 1; },
                    Status::REASON_COMMAND_SEQUENCE, &Status::refused_sequence},
        RefusalCase{"Repeated", [](joint_command_t* c) { c->tick = 19; },
                    Status::REASON_COMMAND_SEQUENCE, &Status::refused_sequence},
        RefusalCase{"OfNegativeTick",
                    [](joint_command_t* c) { c->tick = std::numeric_limits<int64_t>::min(); },
                    Status::REASON_COMMAND_SEQUENCE, &Status::refused_sequence},
        RefusalCase{"Short", [](joint_command_t* c) { c->torque.pop_back(); },
                    Status::REASON_COMMAND_SIZE, &Status::refused_size},
        RefusalCase{"Empty", [](joint_command_t* c) { c->torque.clear(); },
                    Status::REASON_COMMAND_SIZE, &Status::refused_size},
        RefusalCase{"OfWrongCount", [](joint_command_t* c) { c->num_joints = 4; },
                    Status::REASON_COMMAND_SIZE, &Status::refused_size},
        RefusalCase{"OfAnotherRun", [](joint_command_t* c) { c->run_id = kRun + 1; },
                    Status::REASON_COMMAND_RUN, &Status::refused_run}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Supervisor, AcceptsCommandsUpToTheAllowedAgeAndRefusesOlderOnes) {
  Bench bench;
  for (int i = 0; i < 10; ++i) bench.Step(nullptr);
  const joint_command_t late = Command(bench.cycle() - 3, 10);
  bench.Step(&late);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
  EXPECT_EQ(bench.status().command_age, 3);
  // The next cycle has nothing newer: the data it would hold is four cycles old.
  bench.Step(nullptr);
  EXPECT_EQ(bench.status().state, Status::STATE_DAMPING);
  const joint_command_t stale = Command(late.tick + 1, 10);
  bench.Step(&stale);  // cycle 12, tick 8: after the last accepted, but four cycles old
  EXPECT_EQ(bench.status().state, Status::STATE_DAMPING);
  EXPECT_EQ(bench.status().reason, Status::REASON_COMMAND_STALE);
  EXPECT_EQ(bench.status().refused_stale, 1);
}

TEST(Supervisor, AnInfeasibleCommandIsFollowed) {
  Bench bench;
  joint_command_t command = Command(0, 10);
  command.status = joint_command_t::STATUS_INFEASIBLE;  // of the contacts, not of the torque
  bench.Step(&command);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
  EXPECT_DOUBLE_EQ(bench.drives().current[0], 2);
}

TEST(Supervisor, OneBadCommandAmongGoodOnesChangesNothingButItsCount) {
  Bench bench;
  bench.Step(10.0);
  bench.Step(kNan);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
  EXPECT_DOUBLE_EQ(bench.drives().current[0], 2);
  bench.Step(15.0);
  EXPECT_DOUBLE_EQ(bench.drives().current[0], 3);
  EXPECT_EQ(bench.status().refused_not_finite, 1);
  EXPECT_EQ(bench.status().reason, Status::REASON_NONE);
}

TEST(Supervisor, EmergencyStopDampsRampsOutAndLatches) {
  Bench bench;
  bench.Run(100, 10, 1.0);
  bench.supervisor().EmergencyStop();
  for (int i = 0; i < 50; ++i) {
    bench.Step(10.0, 1.0);
    ASSERT_EQ(bench.status().state, Status::STATE_ESTOP);
    ASSERT_EQ(bench.status().reason, Status::REASON_OPERATOR);
    EXPECT_NEAR(bench.drives().current[0], -4.0 * (50 - i) / 50, 0.03);
    bench.supervisor().EmergencyStop();  // pressing it again does not start the ramp again
  }
  for (int i = 0; i < 1000; ++i) {
    bench.Step(10.0, 1.0);
    ASSERT_TRUE(bench.AllFree());
    ASSERT_EQ(bench.status().state, Status::STATE_ESTOP);
  }
}

TEST(Supervisor, EmergencyStopBeforeTheFirstCommandNeverEnables) {
  Bench bench;
  bench.supervisor().EmergencyStop();
  for (int i = 0; i < 200; ++i) {
    bench.Step(10.0, 1.0);
    ASSERT_TRUE(bench.AllFree());
    ASSERT_EQ(bench.status().state, Status::STATE_ESTOP);
  }
}

TEST(Supervisor, EmergencyStopAfterAStopKeepsTheFirstReasonAndTheRamp) {
  Bench bench;
  bench.Run(50, 10, 1.0);
  bench.feedback().drive_status[1] = drive_feedback_t::DRIVE_FAULT;
  bench.Step(10.0, 1.0);
  ASSERT_EQ(bench.status().state, Status::STATE_STOPPING);
  for (int i = 0; i < 24; ++i) bench.Step(10.0, 1.0);
  bench.supervisor().EmergencyStop();
  bench.Step(10.0, 1.0);
  EXPECT_EQ(bench.status().state, Status::STATE_ESTOP);
  EXPECT_EQ(bench.status().reason, Status::REASON_DRIVE_FAULT);
  EXPECT_NEAR(bench.drives().current[0], -4.0 * 25 / 50, 0.03);
}

TEST(Supervisor, AFaultyDriveIsFreedAtOnceAndTheOthersAreDamped) {
  Bench bench;
  bench.Run(100, 10, 1.0);
  bench.feedback().drive_status[1] = drive_feedback_t::DRIVE_FAULT;
  bench.Step(10.0, 1.0);
  EXPECT_EQ(bench.status().state, Status::STATE_STOPPING);
  EXPECT_EQ(bench.status().reason, Status::REASON_DRIVE_FAULT);
  EXPECT_EQ(bench.drives().enabled[1], 0);
  EXPECT_EQ(bench.drives().current[1], 0);
  EXPECT_EQ(bench.drives().enabled[0], 1);
  EXPECT_NEAR(bench.drives().current[0], -4.0, 0.03);
  bench.feedback().drive_status[1] = drive_feedback_t::DRIVE_ENABLED;  // gone, but latched
  bench.Step(10.0, 1.0);
  EXPECT_EQ(bench.drives().enabled[1], 0);
  for (int i = 0; i < 50; ++i) bench.Step(10.0, 1.0);
  EXPECT_TRUE(bench.AllFree());
}

TEST(Supervisor, AnUnknownDriveStatusIsAFault) {
  Bench bench;
  bench.Step(10.0);
  bench.feedback().drive_status[0] = 99;
  bench.Step(10.0);
  EXPECT_EQ(bench.status().reason, Status::REASON_DRIVE_FAULT);
}

TEST(Supervisor, FeedbackThatIsNotFiniteStops) {
  const std::vector<std::function<void(drive_feedback_t*)>> spoils = {
      [](drive_feedback_t* f) { f->current[2] = kNan; },
      [](drive_feedback_t* f) { f->imu_acceleration[0] = kInfinity; },
      [](drive_feedback_t* f) { f->imu_angular_velocity[2] = kNan; },
      [](drive_feedback_t* f) { f->current[0] = 1e300; },
      [](drive_feedback_t* f) { f->position_counts.pop_back(); },
      [](drive_feedback_t* f) { f->drive_status.clear(); },
      [](drive_feedback_t* f) { f->foot_wrench.clear(); },
      [](drive_feedback_t* f) { f->foot_sensor.clear(); },
  };
  for (size_t i = 0; i < spoils.size(); ++i) {
    Bench bench;
    bench.Run(10, 10, 0);
    drive_feedback_t bad = bench.Turn(0);
    spoils[i](&bad);
    EXPECT_FALSE(bench.supervisor().Read(bad)) << i;
    const joint_command_t command = Command(bench.cycle(), 10);
    bench.End(&command);
    EXPECT_EQ(bench.status().state, Status::STATE_STOPPING) << i;
    EXPECT_EQ(bench.status().reason, Status::REASON_FEEDBACK_NOT_FINITE) << i;
    EXPECT_EQ(bench.drives().current[0], 0) << i;  // no velocity is known to damp
    for (int k = 0; k < 50; ++k) bench.Step(10.0);
    EXPECT_TRUE(bench.AllFree()) << i;
  }
}

TEST(Supervisor, AnEncoderThatJumpsStops) {
  SupervisorConfig config = ThreeJoints();
  config.velocity_limit = {9, 9, 9};
  const double most = 5 * 9 * config.period;  // rad in a cycle
  for (const double share : {-1.01, -0.99, 0.99, 1.01}) {
    Bench bench(config);
    bench.Run(10, 10, 0);
    bench.Step(10.0, share * most / config.period);
    const bool stops = std::abs(share) > 1;
    EXPECT_EQ(bench.status().state, stops ? Status::STATE_STOPPING : Status::STATE_RUNNING);
    EXPECT_EQ(bench.status().reason, stops ? Status::REASON_ENCODER_JUMP : Status::REASON_NONE);
    EXPECT_TRUE(std::isfinite(bench.drives().current[0]));
    EXPECT_EQ(bench.status().reason_joint, stops ? 0 : -1);
    if (stops) {
      EXPECT_EQ(bench.drives().current[0], 0);
    }
  }
}

TEST(Supervisor, ADriveThatStaysDisabledIsAFault) {
  Bench bench;
  bench.feedback().drive_status[1] = drive_feedback_t::DRIVE_DISABLED;
  for (int i = 0; i < 10; ++i) bench.Step(nullptr);  // not told to enable yet
  ASSERT_EQ(bench.status().state, Status::STATE_INIT);
  for (int i = 0; i < 2; ++i) {  // told in the first of them
    bench.Step(10.0);
    ASSERT_EQ(bench.status().state, Status::STATE_ENABLING) << i;
    ASSERT_EQ(bench.status().reason, Status::REASON_DRIVE_NOT_ENABLED);
    ASSERT_EQ(bench.status().reason_joint, 1);
    for (size_t j = 0; j < kJoints; ++j) {
      ASSERT_EQ(bench.drives().enabled[j], 1);
      ASSERT_EQ(bench.drives().current[j], 0);  // none has torque before all are enabled
    }
  }
  bench.Step(10.0);
  EXPECT_EQ(bench.status().state, Status::STATE_STOPPED);
  EXPECT_EQ(bench.status().reason, Status::REASON_DRIVE_NOT_ENABLED);
  EXPECT_EQ(bench.status().reason_joint, 1);
  EXPECT_TRUE(bench.AllFree());
}

TEST(Supervisor, ADriveThatDropsOutWhileRunningIsAFault) {
  Bench bench;
  bench.Run(10, 10, 0);
  bench.feedback().drive_status[2] = drive_feedback_t::DRIVE_DISABLED;
  bench.Step(10.0);
  EXPECT_EQ(bench.status().state, Status::STATE_STOPPING);
  EXPECT_EQ(bench.status().reason, Status::REASON_DRIVE_FAULT);
  EXPECT_EQ(bench.status().reason_joint, 2);
}

TEST(Supervisor, ADriveMayTakeTwoCyclesToEnable) {
  Bench bench;
  bench.feedback().drive_status[1] = drive_feedback_t::DRIVE_DISABLED;
  for (int i = 0; i < 2; ++i) bench.Step(10.0);
  bench.feedback().drive_status[1] = drive_feedback_t::DRIVE_ENABLED;
  bench.Run(10, 10, 0);
  EXPECT_EQ(bench.status().state, Status::STATE_RUNNING);
}

TEST(Supervisor, WithoutFeedbackDampingHasNoTorqueAndTheVelocityIsNotJoinedAcrossTheGap) {
  Bench bench;
  bench.Run(100, 10, 1.0);
  for (int i = 0; i < 5; ++i) bench.End(nullptr);
  ASSERT_EQ(bench.status().state, Status::STATE_DAMPING);
  EXPECT_EQ(bench.drives().current[0], 0);
  EXPECT_EQ(bench.drives().enabled[0], 1);
  // The joint has moved 1 rad meanwhile: that is not 500 rad/s.
  bench.Turn(500);
  bench.Step(nullptr, 0);
  EXPECT_NEAR(bench.drives().current[0], -4.0, 0.05);
}

TEST(Supervisor, VelocityFollowsARampOfPositionWithTheFiltersTimeConstant) {
  Bench bench;
  bench.Step(nullptr, 0);
  const double time_constant = 1 / (2 * std::numbers::pi * 60);
  for (int i = 1; i <= 20; ++i) {
    bench.Step(nullptr, 2.0);
    const double expected = 2.0 * (1 - std::exp(-i * 0.002 / time_constant));
    EXPECT_NEAR(bench.supervisor().joint_velocity()[0], expected, 0.01) << i;
  }
}

}  // namespace
}  // namespace poise
