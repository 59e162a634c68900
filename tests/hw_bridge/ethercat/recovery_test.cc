// Slaves that leave OP while the cycle goes on, and come back: a cut cable, a drive that starts
// anew, and what is known of them meanwhile.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/hw_bridge/ethercat/chain_fixture.h"

namespace poise::ethercat {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr uint8_t kOp = 0x08;

struct AttendedBench : Bench {
  explicit AttendedBench(int drives) : Bench(drives) { master_config.set_drift_frames(50); }
  ~AttendedBench() { master.reset(); }
  /// Enabled with torque, and attended in step with the cycles.
  void Run() {
    Start();
    master->Attend(true, [this](const std::string& line) { said.push_back(line); });
    SetTorque(500, 1000);
    Drive(DriveGoal::kEnabled, 20);
    for (const TestLoad& load : loads) ASSERT_NEAR(load.torque_, 0.75, 1e-9);
  }
  /// Cycles without torque until all slaves are in OP and answer; -1: they never do.
  int CyclesUntilWhole() {
    SetTorque(0, 0);
    for (int cycle = 0; cycle < 5000; ++cycle) {
      const CycleResult result = Cycle();
      for (size_t i = 0; i < chain->size(); ++i) {
        greatest = std::max(greatest, std::abs(loads[i].torque_));
      }
      if (result.complete && result.al_status == kOp) return cycle;
    }
    return -1;
  }
  void Cycles(double seconds) {
    for (int i = 0; i < seconds * 500; ++i) Cycle();
  }
  std::vector<std::string> said;
  double greatest = 0;
};

class LinkCut : public ::testing::TestWithParam<double> {};

// Where before the drives stayed in SAFE-OP with 0x001B for good.
TEST_P(LinkCut, LeadsTheDrivesBackToOp) {
  AttendedBench bench(12);
  bench.Run();
  bench.faulty->set_faults({.lost_out = 1});
  bench.Cycles(GetParam());
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(bench.loads[i].torque_, 0) << i;  // their watchdogs
    EXPECT_EQ(bench.chain->slave(i).al_state(), AlState::kSafeOp);
  }
  bench.faulty->set_faults({});
  const int cycles = bench.CyclesUntilWhole();
  EXPECT_GE(cycles, 0);
  EXPECT_LT(cycles, 500) << "a second";
  EXPECT_EQ(bench.greatest, 0);
  bench.Cycles(1);
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(bench.master->attendant()->diagnosis(i).recoveries, 1);
    // The drives' own fault is the operator's to reset.
    EXPECT_EQ(bench.State(i), DriveState::kFault);
  }
  EXPECT_THAT(bench.said, Contains(HasSubstr("0x001B (sync manager watchdog)")));
  EXPECT_THAT(bench.said, Contains(HasSubstr("joint_11): is in OP again")));
  RecordProperty("cycles", cycles);
}
INSTANTIATE_TEST_SUITE_P(Seconds, LinkCut, ::testing::Values(0.3, 3.0));

TEST(EthercatRecovery, SurvivesACutInTheMiddle) {
  AttendedBench bench(6);
  bench.Run();
  bench.chain->CutAfter(3);
  bench.Cycles(0.3);
  const Attendant& attendant = *bench.master->attendant();
  EXPECT_TRUE(attendant.diagnosis(2).online);
  EXPECT_FALSE(attendant.diagnosis(3).online);
  EXPECT_EQ(bench.chain->slave(0).al_state(), AlState::kOp);
  bench.chain->CutAfter(6);
  EXPECT_GE(bench.CyclesUntilWhole(), 0);
  bench.Cycles(1);
  EXPECT_TRUE(attendant.diagnosis(3).online);
  EXPECT_EQ(attendant.diagnosis(3).lost_links, 1);  // its port 0
  EXPECT_EQ(attendant.diagnosis(2).lost_links, 1);  // its port 1
  EXPECT_EQ(attendant.diagnosis(0).lost_links, 0);
}

// Power off and on: everything is to be done again, from its station address to its clock.
TEST(EthercatRecovery, TakesADriveBackThatStartedAnew) {
  for (const size_t drive : {0, 2}) {  // the first is the reference clock
    AttendedBench bench(4);
    for (int i = 0; i < 4; ++i) {
      bench.chain_config.mutable_drive(i)->set_clock_start(1'000'000'000LL * i);
    }
    bench.Run();
    bench.chain->PowerOff(drive);
    bench.Cycles(0.1);
    bench.chain->PowerOn(drive);
    EXPECT_EQ(bench.chain->slave(drive).al_state(), AlState::kInit);
    const int cycles = bench.CyclesUntilWhole();
    EXPECT_GE(cycles, 0);
    EXPECT_EQ(bench.greatest, 0);
    bench.Cycles(0.5);
    EXPECT_EQ(bench.State(drive), DriveState::kSwitchOnDisabled);
    EXPECT_EQ(bench.chain->slave(drive).objects().Find({0x1A07, 0})->value, 5U);
    for (size_t i = 0; i < 4; ++i) {
      EXPECT_LT(std::abs(bench.chain->slave(i).esc().SystemTime() -
                         bench.chain->slave(3).esc().SystemTime()),
                1000)
          << i;
    }
    EXPECT_THAT(bench.said, Contains(HasSubstr("has started anew")));
  }
}

TEST(EthercatRecovery, LeavesAnotherDeviceAlone) {
  AttendedBench bench(3);
  bench.Run();
  bench.chain->PowerOff(1);
  bench.Cycles(0.1);
  bench.chain->ChangeDevice(1, 77);
  bench.chain->PowerOn(1);
  bench.Cycles(2);
  EXPECT_THAT(bench.said, Contains(HasSubstr("product code is 0x0000004D")));
  EXPECT_EQ(bench.chain->slave(1).al_state(), AlState::kInit);
  EXPECT_EQ(bench.chain->slave(0).al_state(), AlState::kOp);
}

TEST(EthercatRecovery, TellsWhatSlavesSayOfThemselves) {
  AttendedBench bench(3);
  bench.Run();
  bench.chain->slave(1).drive().TriggerFault(kErrorOverCurrent);
  bench.chain->slave(2).esc().CountReceiveError(0);
  bench.Cycles(1);
  const Attendant& attendant = *bench.master->attendant();
  const SlaveDiagnosis& fault = attendant.diagnosis(1);
  EXPECT_EQ(fault.al.load().status, kOp);
  EXPECT_EQ(fault.error_code, kErrorOverCurrent);
  EXPECT_EQ(fault.emergency, kErrorOverCurrent);
  EXPECT_EQ(fault.emergencies, 1);
  EXPECT_EQ(attendant.diagnosis(2).receive_errors, 1);
  EXPECT_EQ(attendant.diagnosis(2).error_code, 0);
  EXPECT_EQ(attendant.diagnosis(0).receive_errors, 0);
  EXPECT_TRUE(bench.said.empty());
}

TEST(EthercatRecovery, StopsWhileItRecovers) {
  AttendedBench bench(4);
  bench.Run();
  bench.chain->CutAfter(2);
  bench.Cycles(0.2);
  EXPECT_FALSE(bench.master->Stop());
  bench.chain->CutAfter(4);
  bench.master->Start();
  EXPECT_TRUE(bench.Cycle().complete);
}

}  // namespace
}  // namespace poise::ethercat
