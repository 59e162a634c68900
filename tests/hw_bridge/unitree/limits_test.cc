// The supervisor's behaviours on a Unitree robot, on the commands that leave for it, as
// tests/hw_bridge/behaviours_test.cc has them on the frames of EtherCAT.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/hw_bridge/unitree/robot_rig.h"

namespace poise {
namespace {

using Status = bridge_status_t;

constexpr size_t kHip = 1;  // as BridgeRig's: right_hip_roll, 0.35 rad to the outside at least

TEST(UnitreeStart, WaitsForMotorsThatAreEnabled) {
  RobotRig rig("enable_cycles: 20");
  rig.motors_enable = false;  // mode stays 0, whatever is commanded
  rig.Open();
  rig.command.torque.assign(kMotors, 5);
  const int cycles = rig.CyclesUntil([&] { return rig.status().state == Status::STATE_STOPPED; });
  EXPECT_GE(cycles, 19);
  EXPECT_LE(cycles, 80);
  EXPECT_EQ(rig.status().reason, Status::REASON_DRIVE_NOT_ENABLED);
  EXPECT_TRUE(rig.AtRest());
  EXPECT_FALSE(rig.robot.torque_seen);
}

TEST(UnitreeStart, FadesTheFirstCommandIn) {
  RobotRig rig("first_command_ramp: 0.04");
  rig.Open();
  rig.command.torque.assign(kMotors, 21);
  rig.CyclesUntil([&] { return rig.status().state == Status::STATE_RUNNING; });
  for (int i = 1; i <= 21; ++i) {
    ASSERT_NEAR(rig.told(0).tau, i, 1e-4);
    rig.Step();
  }
  EXPECT_NEAR(rig.told(0).tau, 21, 1e-4);
}

TEST(UnitreeStart, NeedsJointsInTheirRangeAndAtRest) {
  RobotRig rig;
  const auto upper = static_cast<float>(rig.model->joints()[kHip].upper);
  rig.state_of(kHip).q = upper + 0.1F;
  rig.Open();
  rig.command.torque.assign(kMotors, 5);
  rig.Run(50);
  EXPECT_EQ(rig.status().state, Status::STATE_INIT);
  EXPECT_EQ(rig.status().reason, Status::REASON_START_POSITION);
  EXPECT_EQ(rig.status().reason_joint, static_cast<int>(kHip));
  rig.state_of(kHip).q = upper + 0.05F;
  for (int i = 0; i < 42; ++i) rig.Step(true, -1);
  EXPECT_EQ(rig.status().reason, Status::REASON_START_VELOCITY);
  EXPECT_FALSE(rig.robot.torque_seen);
  rig.Run(60);
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
}

TEST(UnitreeCommands, AreHeldForThreeCyclesThenDampedThenStopped) {
  RobotRig rig;
  rig.Start(5);
  for (int i = 0; i < 30; ++i) rig.Step(true, 0.2);
  ASSERT_EQ(rig.status().state, Status::STATE_RUNNING);
  const auto changed = [&] { return rig.told(kHip).tau != 5; };
  EXPECT_EQ(rig.CyclesUntil(changed, false, 0.2), 3);
  EXPECT_EQ(rig.status().state, Status::STATE_DAMPING);
  EXPECT_NEAR(rig.TorqueOf(kHip), -20 * 0.2, 0.3);  // N·m·s/rad × rad/s
  EXPECT_EQ(
      rig.CyclesUntil([&] { return rig.status().state == Status::STATE_STOPPING; }, false, 0.2),
      8);  // 13 cycles old: 26 ms
  rig.CyclesUntil([&] { return rig.status().state == Status::STATE_STOPPED; }, false, 0.2);
  for (int i = 0; i < 100; ++i) {
    rig.Step();
    ASSERT_TRUE(rig.AtRest()) << "latched";
  }
}

TEST(UnitreeCommands, ThatAreRefusedChangeNoByte) {
  const auto refused = [](const std::function<void(RobotRig*)>& spoil, int64_t Status::*counter) {
    RobotRig rig;
    rig.Start(5);
    const joint_command_t good = rig.command;
    rig.command.torque.assign(kMotors, 30);
    spoil(&rig);
    rig.Step();
    for (size_t j = 0; j < kMotors; ++j) EXPECT_FLOAT_EQ(rig.told(j).tau, 5);
    EXPECT_EQ(rig.status().*counter, 1);
    rig.command = good;
    rig.Step();
    EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
  };
  refused([](RobotRig* r) { r->command.torque[3] = std::nan(""); }, &Status::refused_not_finite);
  refused([](RobotRig* r) { r->command.torque.pop_back(); }, &Status::refused_size);
  refused([](RobotRig* r) { r->command.num_joints = 13; }, &Status::refused_size);
  refused([](RobotRig* r) { r->command.run_id = 6; }, &Status::refused_run);
}

TEST(UnitreeCommands, StayWithinTorqueSlewAndHeat) {
  RobotRig rig("slew_limit: 10000 frozen_torque: 1e6");
  rig.Start(0);
  rig.command.torque.assign(kMotors, 500);
  rig.Step();
  EXPECT_NEAR(rig.told(kHip).tau, 20, 1e-4);  // 10000 N·m/s for 2 ms
  EXPECT_NE(rig.status().saturated[kHip] & Status::LIMIT_SLEW, 0);
  rig.Run(10);
  const robot::MotorModel& motor = rig.model->motors()[kHip];
  const double peak =
      std::min(rig.model->joints()[kHip].effort, motor.torque_per_ampere() * motor.peak_current);
  const double rated = motor.torque_per_ampere() * motor.rated_current;
  EXPECT_NEAR(rig.told(kHip).tau, peak, 1e-3);
  EXPECT_NE(rig.status().saturated[kHip] & Status::LIMIT_TORQUE, 0);
  // 2 s at the peak, whose square is 4 of the rating's.
  const int cycles = rig.CyclesUntil([&] { return rig.told(kHip).tau < 1.01 * rated; });
  EXPECT_GT(cycles, 900);
  EXPECT_LT(cycles, 1300);
  EXPECT_NE(rig.status().saturated[kHip] & Status::LIMIT_THERMAL, 0);
}

TEST(UnitreeStop, RangesAreSoftThenTrip) {
  RobotRig rig("velocity_trip: 100");
  const double upper = rig.model->joints()[kHip].upper;
  rig.state_of(kHip).q = static_cast<float>(upper - 0.025);
  rig.Start(5);
  EXPECT_NEAR(rig.told(kHip).tau, 2.5, 0.01);  // half of the soft range's 0.05 rad
  EXPECT_FLOAT_EQ(rig.told(kHip + 1).tau, 5);
  while (static_cast<double>(rig.state_of(kHip).q) <= upper + 0.05) {
    ASSERT_EQ(rig.status().state, Status::STATE_RUNNING);
    rig.state_of(kHip).q += 0.004F;
    rig.Step();
  }
  EXPECT_EQ(rig.status().reason, Status::REASON_JOINT_POSITION);
  EXPECT_EQ(rig.status().reason_joint, static_cast<int>(kHip));
  for (size_t j = 0; j < kMotors; ++j) EXPECT_NE(rig.told(j).tau, 5) << j;
}

TEST(UnitreeStop, AJointThatIsTooFastTrips) {
  RobotRig rig("velocity_trip: 0.2");
  rig.Start(5);
  EXPECT_NE(rig.CyclesUntil([&] { return rig.told(kHip).tau != 5; }, true, -2.5), -1);
  EXPECT_EQ(rig.status().reason, Status::REASON_JOINT_VELOCITY);
}

TEST(UnitreeStop, TwentyBadStatesOfAHundredStop) {
  RobotRig rig;
  rig.Start(5);
  int bad = 0;
  for (int cycle = 0; rig.status().state == Status::STATE_RUNNING && cycle < 300; ++cycle) {
    rig.robot.silent = cycle % 4 == 0;
    bad += rig.robot.silent ? 1 : 0;
    rig.Step();
  }
  EXPECT_EQ(bad, 20);
}

TEST(UnitreeStop, LateCyclesStop) {
  RobotRig rig;
  rig.Start(5);
  rig.Step(true, 0, 0.003);
  EXPECT_EQ(rig.status().overruns, 1);
  rig.Run(20);
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
  EXPECT_EQ(rig.CyclesUntil([&] { return rig.told(kHip).tau != 5; }, true, 0, 0.003), 24);
  EXPECT_EQ(rig.status().reason, Status::REASON_CYCLE_OVERRUN);
}

TEST(UnitreeStop, AnEncoderThatStandsStillOrJumpsStops) {
  {
    RobotRig rig("velocity_trip: 100");
    rig.Start(5);
    float held = 0;
    int cycles = -1;
    for (int i = 0; i < 200 && cycles < 0; ++i) {
      const double speed = i % 2 == 0 ? 0.1 : -0.1;
      rig.command.torque.assign(kMotors, i % 2 == 0 ? -15 : 15);
      rig.state_of(kHip).q = held - static_cast<float>(speed * 0.002);  // Step adds it again
      rig.Step(true, speed);
      if (rig.status().state != Status::STATE_RUNNING) cycles = i;
    }
    EXPECT_EQ(rig.status().reason, Status::REASON_ENCODER_FROZEN);
    EXPECT_EQ(rig.status().reason_joint, static_cast<int>(kHip));
    EXPECT_GE(cycles, 45);
    EXPECT_LE(cycles, 55);
  }
  {
    RobotRig rig;
    rig.Start(5);
    const double before = rig.readings().joint_position[kHip];
    rig.state_of(kHip).q += 0.2F;
    rig.Step();
    EXPECT_EQ(rig.status().reason, Status::REASON_ENCODER_JUMP);
    EXPECT_EQ(rig.readings().joint_position[kHip], before) << "not used";
    EXPECT_NE(rig.told(kHip).tau, 5);
  }
}

TEST(UnitreeStop, ACleanExitRampsAndLeavesTheMotorsDamped) {
  RobotRig rig;
  rig.Start(5);
  rig.bridge->Idle();
  EXPECT_EQ(rig.status().reason, Status::REASON_SHUTDOWN);
  EXPECT_EQ(rig.bridge->Close(), "");
  EXPECT_TRUE(rig.AtRest());
  for (size_t j = 0; j < kMotors; ++j) EXPECT_EQ(rig.told(j).kd, 8);
}

TEST(UnitreeStart, IdlingGivesNoTorqueAndKeepsTheRobotsWatchdogContent) {
  RobotRig rig;
  rig.Open();
  const int before = rig.robot.commands;
  for (int i = 0; i < 200; ++i) {
    rig.bridge->Idle();
    ASSERT_TRUE(rig.AtRest());
  }
  EXPECT_EQ(rig.robot.commands - before, 200);
}

}  // namespace
}  // namespace poise
