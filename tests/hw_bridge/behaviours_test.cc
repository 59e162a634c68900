// The bridge's protective behaviours on the emulated chain, judged by the bytes of the frames, with
// the cycles from fault to reaction: 0 means the frame of the cycle in which the fault shows.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/hw_bridge/bridge_rig.h"

namespace poise {
namespace {

using ethercat::kControlDisableVoltage;
using ethercat::kControlEnable;
using ethercat::kControlQuickStop;
using testing::HasSubstr;
using Status = bridge_status_t;

constexpr size_t kHip = 2;  // right_hip_pitch: -1.9 to 0.7 rad, 150 N·m

class Behaviour : public testing::Test {
 protected:
  /// A row of docs/reference/ethercat.md's table.
  static void Report(const std::string& fault, const std::string& reaction, int cycles) {
    RecordProperty(reaction.c_str(), cycles);
    Rows().push_back(fmt::format("  {:<44} {:<44} {:>3}", fault, reaction, cycles));
  }
  static void TearDownTestSuite() {
    fmt::print("  {:<44} {:<44} cycles\n", "fault", "reaction on the wire");
    for (const std::string& row : Rows()) fmt::print("{}\n", row);
  }
  static std::vector<std::string>& Rows() {
    static std::vector<std::string> rows;
    return rows;
  }
  /// The ramp after a stop, then a quick stop, then nothing for good.
  static void ExpectStop(BridgeRig* rig, double speed = 0) {
    const auto quick_stop = [rig] {
      for (size_t i = 0; i < kDrives; ++i) {
        if (rig->wire.controlword(i) == kControlQuickStop) return true;
      }
      return false;
    };
    EXPECT_GE(rig->CyclesUntil(quick_stop, true, speed), 0);
    for (size_t i = 0; i < kDrives; ++i) EXPECT_EQ(rig->wire.limit(i), 0) << i;
    rig->Run(20, speed);
    EXPECT_TRUE(rig->wire.AllQuiet());
    for (const Shaft& shaft : rig->shafts) EXPECT_EQ(shaft.torque, 0);
    EXPECT_GE(rig->status().state, Status::STATE_STOPPED);
  }
};

std::string OpenError(BridgeRig* rig) {
  try {
    rig->Open();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST_F(Behaviour, StartsOnlyWithTheDrivesThatAreConfigured) {
  const auto error = [](auto change) {
    BridgeRig rig;
    change(rig.chain_config);
    const std::string what = OpenError(&rig);
    EXPECT_FALSE(rig.wire.torque_seen());
    for (const Shaft& shaft : rig.shafts) EXPECT_EQ(shaft.torque, 0);
    return what;
  };
  using Chain = ethercat::EmulatedChainConfig;
  EXPECT_EQ(error([](Chain&) {}), "");
  EXPECT_THAT(error([](Chain& c) { c.mutable_drive()->RemoveLast(); }), HasSubstr("11 slaves"));
  EXPECT_THAT(error([](Chain& c) { c.add_drive(); }), HasSubstr("13 slaves"));
  EXPECT_THAT(error([](Chain& c) { c.mutable_drive(4)->set_vendor_id(1); }), HasSubstr("vendor"));
  EXPECT_THAT(error([](Chain& c) { c.mutable_drive(4)->set_product_code(1); }),
              HasSubstr("product code"));
  EXPECT_THAT(error([](Chain& c) { c.mutable_drive(4)->set_rated_torque(1600); }),
              HasSubstr("rated_torque"));
  EXPECT_THAT(error([](Chain& c) { c.mutable_drive(4)->set_rated_current(14000); }),
              HasSubstr("rated_current"));
}

TEST_F(Behaviour, GivesNoTorqueUntilAllDrivesAreEnabled) {
  BridgeRig rig;
  rig.chain_config.mutable_drive(4)->set_transition_time(20);  // ms
  rig.Open();
  rig.command.torque.assign(kDrives, 15);
  int cycles = 0;
  for (; rig.status().state != Status::STATE_RUNNING && cycles < 200; ++cycles) {
    for (size_t i = 0; i < kDrives; ++i) {
      ASSERT_EQ(rig.wire.torque(i), 0);
      ASSERT_EQ(rig.wire.limit(i), 0);
    }
    rig.Step();
    if (cycles > 0 && cycles < 30) {
      ASSERT_EQ(rig.status().state, Status::STATE_ENABLING);
      ASSERT_EQ(rig.status().reason, Status::REASON_DRIVE_NOT_ENABLED);
    }
  }
  EXPECT_GT(cycles, 30);  // three transitions of 20 ms
  for (size_t i = 0; i < kDrives; ++i) {
    EXPECT_EQ(rig.wire.controlword(i), kControlEnable);
    EXPECT_EQ(rig.wire.torque(i), 200);  // 15 N·m of 75
    EXPECT_EQ(rig.wire.limit(i), 2000);
    EXPECT_EQ(rig.status().drive_state[i], Status::DRIVE_ENABLED);
  }
}

TEST_F(Behaviour, ADriveThatDoesNotComeUpStopsTheStart) {
  BridgeRig rig("enable_cycles: 20");
  rig.chain_config.mutable_drive(7)->set_transition_time(100);
  rig.Open();
  rig.command.torque.assign(kDrives, 15);
  const int cycles = rig.CyclesUntil([&] { return rig.status().state == Status::STATE_STOPPED; });
  Report("(1) drive not enabled (enable_cycles: 20)", "never any torque, all disabled", cycles);
  EXPECT_EQ(rig.status().reason, Status::REASON_DRIVE_NOT_ENABLED);
  EXPECT_EQ(rig.status().reason_joint, 7);
  EXPECT_FALSE(rig.wire.torque_seen());
}

TEST_F(Behaviour, TheFirstCommandIsFadedIn) {
  BridgeRig rig("first_command_ramp: 0.04");
  rig.Open();
  rig.command.torque.assign(kDrives, 15.75);  // 210 per mille
  rig.CyclesUntil([&] { return rig.status().state == Status::STATE_RUNNING; });
  for (int i = 1; i <= 21; ++i) {
    ASSERT_EQ(rig.wire.torque(0), 10 * i);
    rig.Step();
  }
  EXPECT_EQ(rig.wire.torque(0), 210);
}

TEST_F(Behaviour, DoesNotStartOutOfRangeOrMoving) {
  BridgeRig rig;
  rig.Place(kHip, 0.8);
  rig.Open();
  rig.command.torque.assign(kDrives, 15);
  rig.Run(50);
  EXPECT_EQ(rig.status().state, Status::STATE_INIT);
  EXPECT_EQ(rig.status().reason, Status::REASON_START_POSITION);
  EXPECT_EQ(rig.status().reason_joint, static_cast<int>(kHip));
  rig.Place(kHip, 0.75);
  rig.Run(2, -1);
  EXPECT_EQ(rig.status().state, Status::STATE_INIT);
  rig.Run(40, -1);
  EXPECT_EQ(rig.status().reason, Status::REASON_START_VELOCITY);
  EXPECT_FALSE(rig.wire.torque_seen());
  rig.Run(30);
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
}

TEST_F(Behaviour, AnOldCommandIsDampedThenStopped) {
  BridgeRig rig;
  rig.Start(7.5);  // 100 per mille
  rig.Run(30, 0.2);
  ASSERT_EQ(rig.wire.torque(kHip), 100);
  const int damped = rig.CyclesUntil([&] { return rig.wire.torque(kHip) != 100; }, false, 0.2);
  Report("(3) no command", "damping torque instead of the last command", damped);
  EXPECT_EQ(damped, 3);  // held for three cycles
  // −20 N·m·s/rad × 0.2 rad/s = −4 N·m.
  EXPECT_NEAR(rig.wire.torque(kHip) * kStep, -4, 0.2);
  EXPECT_EQ(rig.status().state, Status::STATE_DAMPING);
  const int stopping =
      rig.CyclesUntil([&] { return rig.status().state == Status::STATE_STOPPING; }, false, 0.2);
  Report("(3) no command, 25 ms later", "ramp to zero begins", damped + 1 + stopping);
  EXPECT_EQ(damped + 1 + stopping, 12);  // 13 cycles old: 26 ms
  const int quick =
      rig.CyclesUntil([&] { return rig.wire.controlword(kHip) == kControlQuickStop; }, false, 0.2);
  Report("(3) no command, ramp over (0.1 s)", "quick stop, 6072 = 0",
         damped + 2 + stopping + quick);
  EXPECT_EQ(quick, 49);
  rig.Run(100);
  EXPECT_TRUE(rig.wire.AllQuiet());  // latched
}

TEST_F(Behaviour, AHeldRobotKeepsItsTorque) {
  BridgeRig rig("on_lost_command: HOLD");
  rig.Start(7.5);
  for (int i = 0; i < 500; ++i) {
    rig.Step(false);
    ASSERT_EQ(rig.wire.torque(kHip), 100);
  }
  EXPECT_EQ(rig.status().state, Status::STATE_HOLDING);
  rig.command.torque.assign(kDrives, 15);
  for (int i = 0; i < 11; ++i) {
    const int before = rig.wire.torque(kHip);
    rig.Step();
    ASSERT_NEAR(rig.wire.torque(kHip) - before, 100.0 / 11, 1);
  }
  EXPECT_EQ(rig.wire.torque(kHip), 200);
}

TEST_F(Behaviour, ARefusedCommandChangesNoByte) {
  const auto refused = [](auto spoil, int64_t Status::*counter) {
    BridgeRig rig;
    rig.Start(7.5);
    const joint_command_t good = rig.command;
    rig.command.torque.assign(kDrives, 30);
    spoil(&rig);
    rig.Step();
    for (size_t i = 0; i < kDrives; ++i) EXPECT_EQ(rig.wire.torque(i), 100);
    EXPECT_EQ(rig.status().*counter, 1);
    rig.command = good;
    rig.Step();
    EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
  };
  refused([](BridgeRig* r) { r->command.torque[3] = std::nan(""); }, &Status::refused_not_finite);
  refused([](BridgeRig* r) { r->command.torque.pop_back(); }, &Status::refused_size);
  refused([](BridgeRig* r) { r->command.num_joints = 13; }, &Status::refused_size);
  refused([](BridgeRig* r) { r->command.run_id = 6; }, &Status::refused_run);
  Report("(4) bad command", "its torques never sent, 6071 as before", 0);
}

TEST_F(Behaviour, TorqueStaysWithinTheLimits) {
  // Shafts that torque does not move are no broken encoders here.
  BridgeRig rig("slew_limit: 10000 frozen_torque: 1e6");
  rig.Start(0);
  rig.command.torque.assign(kDrives, 500);
  rig.Step();
  EXPECT_EQ(rig.wire.torque(kHip), 267);  // 20 N·m in a cycle
  EXPECT_EQ(rig.status().saturated[kHip] & Status::LIMIT_SLEW, Status::LIMIT_SLEW);
  rig.Run(10);
  EXPECT_EQ(rig.wire.torque(kHip), 2000);  // 150 N·m
  EXPECT_EQ(rig.wire.torque(5), 1000);     // ankle roll: 75 N·m
  EXPECT_EQ(rig.status().saturated[kHip] & Status::LIMIT_TORQUE, Status::LIMIT_TORQUE);
  const int rated = rig.CyclesUntil([&] { return rig.wire.torque(kHip) < 1010; });
  Report("(5) twice the rated current (overload 2 s)", "6071 at the rating", rated);
  EXPECT_EQ(rig.wire.torque(5), 1000);
  EXPECT_EQ(rig.status().saturated[kHip] & Status::LIMIT_THERMAL, Status::LIMIT_THERMAL);
}

TEST_F(Behaviour, TheDriveHoldsItsOwnLimits) {
  BridgeRig rig("torque_error: 1e6");
  rig.chain_config.mutable_drive(kHip)->set_peak_torque(500);
  rig.Start(0);
  rig.command.torque.assign(kDrives, 60);
  rig.Run(10);
  EXPECT_EQ(rig.wire.torque(kHip), 800);
  EXPECT_NEAR(rig.shafts[kHip].torque, 0.5 * 1.5, 1e-9);
}

TEST_F(Behaviour, RangesAreSoftThenTrip) {
  BridgeRig near;
  near.shafts[kHip].angle = 0.675 * kGear;
  near.Start(15);
  EXPECT_EQ(near.wire.torque(kHip), 100);  // half of 15 N·m
  EXPECT_EQ(near.wire.torque(kHip + 1), 200);
  EXPECT_EQ(near.status().saturated[kHip], Status::LIMIT_POSITION);
  int cycles = 0;
  while (near.shafts[kHip].angle / kGear <= 0.75) {
    near.Place(kHip, near.shafts[kHip].angle / kGear + 0.004);
    near.Step();
    if (near.shafts[kHip].angle / kGear <= 0.75) {
      ASSERT_EQ(near.status().state, Status::STATE_RUNNING) << ++cycles;
    }
  }
  EXPECT_EQ(near.status().reason, Status::REASON_JOINT_POSITION);
  EXPECT_EQ(near.status().reason_joint, static_cast<int>(kHip));
  EXPECT_NE(near.wire.torque(kHip + 1), 200);
  Report("(6) joint beyond its range by 0.05 rad", "damping torque on all joints", 0);
  ExpectStop(&near);
}

TEST_F(Behaviour, TooFastTrips) {
  BridgeRig rig("velocity_trip: 0.2");
  rig.Start(7.5);
  const int cycles = rig.CyclesUntil([&] { return rig.wire.torque(kHip) != 100; }, true, -2.5);
  Report("(6) 2.5 rad/s at a limit of 1.8", "damping torque (mean of 0.1 s)", cycles);
  EXPECT_EQ(rig.status().reason, Status::REASON_JOINT_VELOCITY);
  // From rest a mean of 0.1 s has 1.8 of 2.5 rad/s after 0.1 s × ln(2.5 / 0.7), 64 cycles.
  EXPECT_GE(cycles, 63);
  EXPECT_LE(cycles, 67);
}

TEST_F(Behaviour, ATiltedBodyTrips) {
  BridgeRig rig("tilt_limit: 0.5");
  rig.Start(7.5);
  rig.sensors.imu_angular_velocity[0] = 2;
  double tilt = 0;
  const int cycles = rig.CyclesUntil([&] {
    tilt += 2 * 0.002;
    rig.sensors.imu_acceleration[1] = kGravity * std::sin(tilt);
    rig.sensors.imu_acceleration[2] = kGravity * std::cos(tilt);
    return rig.status().state != Status::STATE_RUNNING;
  });
  EXPECT_EQ(rig.status().reason, Status::REASON_BODY_TILT);
  const int reached = 125;  // 0.5 rad
  EXPECT_NEAR(cycles, reached, 2);
  Report("(6) body beyond the tilt limit", "damping torque on all joints", cycles - reached);
}

TEST_F(Behaviour, OneDrivesFaultStopsAllInTheSameCycle) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.slave(4).drive().TriggerFault(ethercat::kErrorOverCurrent);
  rig.link->AdvanceTo(rig.link->Now() + 1000);  // the drive's next look at its statusword
  const int cycles = rig.CyclesUntil([&] { return rig.wire.limit(4) == 0; });
  Report("(7) a drive's fault", "it freed, damping torque on all others", cycles);
  EXPECT_EQ(cycles, 0);
  EXPECT_EQ(rig.wire.controlword(4), kControlDisableVoltage);
  for (size_t i = 0; i < kDrives; ++i) EXPECT_EQ(rig.wire.torque(i), 0) << i;  // nothing moves
  EXPECT_EQ(rig.status().reason, Status::REASON_DRIVE_FAULT);
  EXPECT_EQ(rig.status().reason_joint, 4);
  ExpectStop(&rig);
  EXPECT_EQ(rig.status().drive_state[4], Status::DRIVE_FAULT);
}

TEST_F(Behaviour, InputsThatAreNotWholeAreNotUsedAndFiveStop) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.Place(0, 0.1);
  rig.slave(11).SetSilent(true);
  rig.Step();
  EXPECT_EQ(rig.readings().joint_position[0], 0);  // that of the cycle before
  EXPECT_TRUE(rig.TakeWithheld());
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
  EXPECT_GE(rig.status().working_counter_errors, 1);
  const int cycles = 1 + rig.CyclesUntil([&] { return rig.wire.torque(kHip) != 100; });
  Report("(8) a slave silent", "torque to zero, stop", cycles);
  EXPECT_EQ(cycles, 4);
  EXPECT_EQ(rig.status().reason, Status::REASON_BUS_INPUTS);
  EXPECT_EQ(rig.status().bus_usable, 0);
  ExpectStop(&rig);
}

TEST_F(Behaviour, TwentyOfAHundredBadCyclesStop) {
  BridgeRig rig;
  rig.Start(7.5);
  int bad = 0;
  for (int cycle = 0; rig.status().state == Status::STATE_RUNNING && cycle < 300; ++cycle) {
    rig.slave(2).SetSilent(cycle % 4 == 0);
    bad += cycle % 4 == 0 ? 1 : 0;
    rig.Step();
  }
  EXPECT_EQ(bad, 20);
  EXPECT_EQ(rig.status().reason, Status::REASON_BUS_INPUTS);
}

TEST_F(Behaviour, LinkLossTripsTheBridgeAndTheDrivesByThemselves) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.faulty->set_faults({.lost_out = 1});
  const int bridge = rig.CyclesUntil([&] { return rig.wire.torque(kHip) != 100; });
  Report("(9) link lost", "torque to zero, stop (what the bridge sends)", bridge);
  EXPECT_EQ(bridge, 4);
  EXPECT_EQ(rig.status().reason, Status::REASON_BUS_LINK);
  EXPECT_NEAR(rig.shafts[kHip].torque, 0.15, 1e-9);  // nothing has reached it
  const int drive = bridge + 1 + rig.CyclesUntil([&] { return rig.shafts[kHip].torque == 0; });
  Report("(9) link lost", "no torque at the drives: watchdog, 50 ms", drive);
  EXPECT_LE(drive, 26);
  for (const Shaft& shaft : rig.shafts) EXPECT_EQ(shaft.torque, 0);
}

TEST_F(Behaviour, AnOperatorsStopLatchesUntilTheEdgeOfAReset) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.stop.stop = 1;
  const int cycles = rig.CyclesUntil([&] { return rig.wire.torque(kHip) != 100; });
  Report("(10) EMERGENCY_STOP", "damping torque, then quick stop", cycles);
  EXPECT_EQ(cycles, 0);
  EXPECT_EQ(rig.status().reason, Status::REASON_OPERATOR);
  rig.stop.stop = 0;
  ExpectStop(&rig);
  rig.stop.reset = 1;
  rig.Run(5);  // while torque is commanded
  EXPECT_EQ(rig.status().state, Status::STATE_ESTOP);
  rig.command.torque.assign(kDrives, 0);
  rig.Run(5);  // no edge
  EXPECT_EQ(rig.status().state, Status::STATE_ESTOP);
  rig.stop.reset = 0;
  rig.Step();
  rig.stop.reset = 1;
  rig.Step(false);
  EXPECT_EQ(rig.status().state, Status::STATE_INIT);
  EXPECT_EQ(rig.status().resets, 1);
  EXPECT_TRUE(rig.wire.AllQuiet());
}

TEST_F(Behaviour, SafeTorqueOffIsAnEmergencyStop) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.slave(6).drive().SetSto(true);
  rig.link->AdvanceTo(rig.link->Now() + 1000);
  const int cycles = rig.CyclesUntil([&] { return rig.wire.torque(kHip) != 100; });
  Report("(10) a drive's STO", "damping torque, then quick stop", cycles);
  EXPECT_EQ(cycles, 0);
  EXPECT_EQ(rig.status().state, Status::STATE_ESTOP);
  EXPECT_EQ(rig.status().reason, Status::REASON_DRIVE_STO);
  EXPECT_EQ(rig.status().reason_joint, 6);
  ExpectStop(&rig);
}

TEST_F(Behaviour, ASignalIsAnEmergencyStop) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.signal = 1;
  const int cycles = rig.CyclesUntil([&] { return rig.wire.torque(kHip) != 100; });
  Report("(10) signal to the process", "damping torque, then quick stop", cycles);
  EXPECT_EQ(cycles, 0);
  EXPECT_EQ(rig.status().reason, Status::REASON_SIGNAL);
  ExpectStop(&rig);
}

TEST_F(Behaviour, AfterAResetAFaultyDriveComesUpAgain) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.slave(4).drive().TriggerFault(ethercat::kErrorOverCurrent);
  rig.Run(100);
  ASSERT_EQ(rig.status().state, Status::STATE_STOPPED);
  rig.command.torque.assign(kDrives, 0);
  rig.stop.reset = 1;
  rig.Step();
  EXPECT_EQ(rig.status().state, Status::STATE_INIT);
  rig.command.torque.assign(kDrives, 7.5);
  rig.CyclesUntil([&] { return rig.status().state == Status::STATE_RUNNING; });
  EXPECT_EQ(rig.wire.torque(4), 100);
  EXPECT_EQ(rig.slave(4).drive().state(), ethercat::DriveState::kOperationEnabled);
}

TEST_F(Behaviour, ASecondFaultNeedsASecondReset) {
  BridgeRig rig;
  rig.Start(7.5);
  for (const int64_t round : {1, 2}) {
    rig.slave(4).drive().TriggerFault(ethercat::kErrorOverCurrent);
    rig.Run(100);
    ASSERT_EQ(rig.status().state, Status::STATE_STOPPED) << round;
    rig.command.torque.assign(kDrives, 0);
    rig.stop.reset = 1;
    rig.Step();
    EXPECT_EQ(rig.status().resets, round);
    rig.stop.reset = 0;
    rig.command.torque.assign(kDrives, 7.5);
    rig.CyclesUntil([&] { return rig.status().state == Status::STATE_RUNNING; });
    rig.Run(3);
    for (size_t i = 0; i < kDrives; ++i) EXPECT_EQ(rig.wire.torque(i), 100) << round;
  }
}

TEST_F(Behaviour, LateCyclesStop) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.Step(true, 0, 0.003);
  EXPECT_EQ(rig.status().overruns, 1);
  EXPECT_EQ(rig.status().lateness, 0.003);
  rig.Run(20);
  EXPECT_EQ(rig.status().state, Status::STATE_RUNNING);
  const int cycles = rig.CyclesUntil([&] { return rig.wire.torque(kHip) != 100; }, true, 0, 0.003);
  Report("(11) cycles more than a period late", "damping torque, stop", cycles);
  EXPECT_EQ(cycles, 24);
  EXPECT_EQ(rig.status().reason, Status::REASON_CYCLE_OVERRUN);
}

TEST_F(Behaviour, AFrozenEncoderStops) {
  BridgeRig rig("velocity_trip: 100");
  rig.Start(7.5);
  rig.Run(10, 0.1);
  rig.slave(kHip).drive().FreezeEncoder(true);
  int cycles = -1;
  for (int i = 0; i < 200 && cycles < 0; ++i) {
    rig.command.torque.assign(kDrives, i % 2 == 0 ? -15 : 15);
    rig.Step(true, i % 2 == 0 ? 0.1 : -0.1);
    if (rig.status().state != Status::STATE_RUNNING) cycles = i;
  }
  Report("(12) encoder frozen, torque varies", "stop (0.1 s)", cycles);
  EXPECT_EQ(rig.status().reason, Status::REASON_ENCODER_FROZEN);
  EXPECT_EQ(rig.status().reason_joint, static_cast<int>(kHip));
  EXPECT_GE(cycles, 48);
  EXPECT_LE(cycles, 55);
}

TEST_F(Behaviour, TorqueThatIsNotTheCommandedOneStops) {
  BridgeRig rig;
  rig.chain_config.mutable_drive(kHip)->set_peak_torque(100);
  rig.Start(7.5);
  rig.command.torque.assign(kDrives, 37.5);  // the drive gives 7.5
  const int cycles = rig.CyclesUntil([&] { return rig.status().state != Status::STATE_RUNNING; });
  Report("(12) measured torque off by 30 N·m", "damping torque, stop", cycles);
  // Two cycles, in which a reading may still be of the command before, and ten that differ.
  EXPECT_EQ(cycles, 12);
  EXPECT_EQ(rig.status().reason, Status::REASON_TORQUE_IMPLAUSIBLE);
  EXPECT_EQ(rig.status().reason_joint, static_cast<int>(kHip));
}

TEST_F(Behaviour, ACleanExitRampsDisablesAndLeadsToInit) {
  BridgeRig rig;
  rig.Start(7.5);
  rig.Run(30, 0.2);
  rig.Step(false, 0.2);
  rig.bridge->Idle();
  EXPECT_EQ(rig.wire.controlword(kHip), kControlEnable);  // it is still on its way down
  EXPECT_EQ(rig.status().reason, Status::REASON_SHUTDOWN);
  EXPECT_EQ(rig.bridge->Close(), "");
  EXPECT_TRUE(rig.wire.AllQuiet());
  for (size_t i = 0; i < kDrives; ++i) {
    EXPECT_EQ(rig.slave(i).al_state(), ethercat::AlState::kInit);
    EXPECT_EQ(rig.slave(i).drive().state(), ethercat::DriveState::kSwitchOnDisabled);
    EXPECT_EQ(rig.shafts[i].torque, 0);
  }
  Report("(13) end of the run", "ramp begins; then disabled, INIT", 0);
}

TEST_F(Behaviour, IdlingKeepsTheDrivesAwakeWithoutTorque) {
  for (const bool enable : {false, true}) {
    BridgeRig rig(enable ? "enable_at_start: true" : "");
    rig.Open();
    for (int i = 0; i < 200; ++i) {
      const int64_t start = rig.link->Now();
      rig.bridge->Idle();
      rig.link->AdvanceTo(start + kPeriod);
      for (size_t k = 0; k < kDrives; ++k) ASSERT_EQ(rig.wire.torque(k), 0);
    }
    for (size_t i = 0; i < kDrives; ++i) {
      EXPECT_EQ(rig.slave(i).al_state(), ethercat::AlState::kOp);
      EXPECT_EQ(rig.slave(i).drive().state(), enable ? ethercat::DriveState::kOperationEnabled
                                                     : ethercat::DriveState::kSwitchOnDisabled);
    }
  }
}

}  // namespace
}  // namespace poise
