// The whole bridge when its bus fails for a while and comes back: torque on the wire, and the way
// to run on without a restart.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/hw_bridge/bridge_rig.h"

namespace poise {
namespace {

using Status = bridge_status_t;

constexpr int kSecondOfCycles = 500;

class BridgeRecovery : public ::testing::Test {
 protected:
  BridgeRecovery() {
    // In step with the cycles, which a lost frame does not make much longer.
    rig_.bus = "attend: true simulated_time: true";
    rig_.master = "frame_timeout: 1";
    rig_.Start(7.5);
  }
  bool MotorsFree() const {
    return std::all_of(rig_.shafts.begin(), rig_.shafts.end(),
                       [](const Shaft& shaft) { return shaft.torque == 0; });
  }
  /// From a bus that works again to torque, with an operator's reset in between.
  void ComeBack(const char* what, int quiet, int free) {
    const int whole = rig_.CyclesUntil([&] { return rig_.status().al_status == 8; });
    ASSERT_GE(whole, 0);
    rig_.Run(kSecondOfCycles / 2);
    EXPECT_EQ(rig_.status().al_status, 8);
    // Slaves in OP again are no reason to give torque.
    EXPECT_GE(rig_.status().state, Status::STATE_STOPPED);
    EXPECT_TRUE(rig_.wire.AllQuiet());
    EXPECT_TRUE(MotorsFree());
    rig_.command.torque.assign(kDrives, 0);
    rig_.Run(3);
    rig_.stop.reset = 1;
    rig_.Step();
    rig_.command.torque.assign(kDrives, 7.5);
    const int running =
        rig_.CyclesUntil([&] { return rig_.status().state == Status::STATE_RUNNING; });
    EXPECT_GE(running, 0) << "state " << int{rig_.status().state} << ", reason "
                          << int{rig_.status().reason};
    rig_.Run(3);
    for (size_t i = 0; i < kDrives; ++i) EXPECT_EQ(rig_.wire.torque(i), 100) << i;
    fmt::print(
        "recovery: {}: 6071 = 0 on the wire after {} cycles, motors free after {}, all slaves in "
        "OP "
        "{} cycles after the bus is whole, running {} after the reset\n",
        what, quiet, free, whole, running);
  }
  void CutFor(double seconds, const char* what) {
    rig_.faulty->set_faults({.lost_out = 1});
    int quiet = -1, free = -1;
    for (int i = 0; i < seconds * kSecondOfCycles; ++i) {
      rig_.Step();
      if (quiet < 0 && rig_.wire.AllQuiet()) quiet = i;
      if (free < 0 && MotorsFree()) free = i;
    }
    EXPECT_GE(quiet, 0);
    EXPECT_GE(free, 0);
    EXPECT_LE(free, 26) << "the drives' watchdog: 50 ms";
    EXPECT_EQ(rig_.status().reason, Status::REASON_BUS_LINK);
    rig_.faulty->set_faults({});
    ComeBack(what, quiet, free);
  }
  BridgeRig rig_;
};

TEST_F(BridgeRecovery, RunsOnAfterTheCableWasCutForAWhile) { CutFor(0.3, "cable cut for 0.3 s"); }

TEST_F(BridgeRecovery, RunsOnAfterTheCableWasCutForLong) { CutFor(3, "cable cut for 3 s"); }

TEST_F(BridgeRecovery, RunsOnAfterADriveWasOffAndOn) {
  constexpr size_t kDrive = 5;
  rig_.chain->PowerOff(kDrive);
  int quiet = -1, free = -1;
  for (int i = 0; i < kSecondOfCycles / 5; ++i) {
    rig_.Step();
    if (quiet < 0 && rig_.wire.AllQuiet()) quiet = i;
    if (free < 0 && MotorsFree()) free = i;
  }
  EXPECT_GE(quiet, 0);
  EXPECT_GE(free, 0);
  EXPECT_EQ(rig_.status().reason, Status::REASON_BUS_INPUTS);
  rig_.chain->PowerOn(kDrive);
  ComeBack("one drive off and on", quiet, free);
}

}  // namespace
}  // namespace poise
