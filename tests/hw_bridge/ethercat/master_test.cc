// The master against the emulated chain: start-up, what it refuses, cyclic exchange, faults.
#include "hw_bridge/ethercat/master.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/framework/toy_components.h"
#include "tests/hw_bridge/ethercat/chain_fixture.h"

namespace poise::ethercat {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr uint8_t kAllOp = 0x08;

/// Start() with the bench as `change` leaves it.
template <class Change>
std::string StartError(int drives, Change change) {
  Bench bench(drives);
  change(bench);
  return ErrorOf([&] { bench.Start(); });
}

TEST(EthercatMaster, StartsTwelveDrivesWithoutTorque) {
  Bench bench(12);
  bench.Start();
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(bench.chain->slave(i).al_state(), AlState::kOp);
    EXPECT_EQ(bench.loads[i].greatest_, 0);
    EXPECT_EQ(bench.chain->slave(i).objects().Find({object::kMaxTorque, 0})->value, 0U);
  }
  const CycleResult result = bench.Cycle();
  EXPECT_TRUE(result.returned);
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.working_counter, 36);
  EXPECT_EQ(result.slaves_answering, 12);
  EXPECT_EQ(result.al_status, kAllOp);
  ASSERT_TRUE(result.system_time.has_value());
  EXPECT_EQ(bench.State(5), DriveState::kSwitchOnDisabled);
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(bench.master->slave(i).ReadIdentity().serial, 100 + i);
  }
}

TEST(EthercatMaster, StartsFromAnyStateAndStopsToInit) {
  Bench bench(2);
  bench.Start();
  bench.master->Start();  // from OP
  EXPECT_EQ(bench.Cycle().working_counter, 6);
  // From SAFE-OP with an error.
  bench.link->AdvanceTo(bench.link->Now() + kSecond);
  ASSERT_TRUE(bench.chain->slave(1).al_error());
  bench.master->Start();
  EXPECT_EQ(bench.Cycle().working_counter, 6);
  EXPECT_TRUE(bench.master->Stop());
  for (size_t i = 0; i < 2; ++i) EXPECT_EQ(bench.chain->slave(i).al_state(), AlState::kInit);
}

TEST(EthercatMaster, RefusesAnotherNumberOfSlaves) {
  EXPECT_THAT(StartError(3, [](Bench& b) { b.chain_config.mutable_drive()->RemoveLast(); }),
              AllOf(HasSubstr("2 slaves"), HasSubstr("3 drives"), HasSubstr("joint_2")));
  EXPECT_THAT(StartError(3, [](Bench& b) { b.chain_config.add_drive(); }), HasSubstr("4 slaves"));
  Bench dead(1);
  dead.Build();
  dead.faulty->set_faults({.lost_out = 1});
  EXPECT_THAT(ErrorOf([&] { dead.master->Start(); }), HasSubstr("no frame comes back"));
  EXPECT_FALSE(dead.master->Stop());
}

TEST(EthercatMaster, RefusesAnotherDriveThanConfigured) {
  EXPECT_THAT(StartError(2, [](Bench& b) { b.chain_config.mutable_drive(1)->set_vendor_id(2); }),
              AllOf(HasSubstr("joint_1"), HasSubstr("vendor is 0x00000002")));
  EXPECT_THAT(StartError(2, [](Bench& b) { b.chain_config.mutable_drive(0)->set_product_code(7); }),
              HasSubstr("product code is 0x00000007"));
  EXPECT_THAT(StartError(2, [](Bench& b) { b.master_config.mutable_profile()->set_revision(1); }),
              HasSubstr("revision"));
  EXPECT_THAT(StartError(2, [](Bench& b) { b.master_config.mutable_drive(1)->set_serial(100); }),
              AllOf(HasSubstr("serial number"), HasSubstr("joint_1")));
  EXPECT_THAT(
      StartError(2, [](Bench& b) { b.chain_config.mutable_drive(1)->set_rated_torque(1400); }),
      AllOf(HasSubstr("6076"), HasSubstr("1400 mN·m"), HasSubstr("1500 mN·m")));
  EXPECT_THAT(
      StartError(2, [](Bench& b) { b.chain_config.mutable_drive(1)->set_rated_current(1); }),
      HasSubstr("6075"));
}

TEST(EthercatMaster, NamesTheAbortOfAMappingThatTheDriveRefuses) {
  const auto map = [](Bench& b, uint32_t index, uint32_t bits) {
    MappedObject& object = *b.master_config.mutable_profile()->add_tx();
    object.set_index(index);
    object.set_bits(bits);
  };
  EXPECT_THAT(StartError(1, [&](Bench& b) { map(b, 0x2000, 16); }),
              AllOf(HasSubstr("writing object 1A07:06"), HasSubstr("0x06040041"),
                    HasSubstr("cannot be mapped into the PDO")));
  EXPECT_THAT(StartError(1,
                         [&](Bench& b) {
                           for (int i = 0; i < 5; ++i) map(b, 0x603F, 16);
                         }),
              HasSubstr("object 1A07:09"));  // the tenth's subindex: the drive has eight
  EXPECT_THAT(
      StartError(1, [](Bench& b) { b.master_config.mutable_profile()->set_rx_pdo(0x1600); }),
      HasSubstr("0x06010002 (attempt to write a read-only object)"));
  EXPECT_THAT(
      StartError(1, [](Bench& b) { b.master_config.mutable_profile()->set_rx_pdo(0x1610); }),
      HasSubstr("the object does not exist in the object dictionary"));
}

TEST(EthercatMaster, RefusesAConfigurationThatCannotWork) {
  const auto error = [](auto change) { return StartError(1, change); };
  EXPECT_THAT(error([](Bench& b) { b.master_config.clear_drive(); }),
              HasSubstr("drive is missing"));
  EXPECT_THAT(error([](Bench& b) { b.master_config.clear_profile(); }), HasSubstr("profile"));
  EXPECT_THAT(error([](Bench& b) { b.master_config.set_cycle(0); }),
              HasSubstr("master.cycle: is 0"));
  EXPECT_THAT(error([](Bench& b) { b.master_config.mutable_drive(0)->set_rated_torque(0); }),
              HasSubstr("master.drive[0].rated_torque: is 0"));
  EXPECT_THAT(error([](Bench& b) { b.master_config.mutable_profile()->set_tx_pdo(0x1600); }),
              HasSubstr("tx_pdo 0x1600"));
  EXPECT_THAT(
      error([](Bench& b) { b.master_config.mutable_profile()->mutable_rx(2)->set_bits(32); }),
      AllOf(HasSubstr("6071"), HasSubstr("CiA 402 gives it 16")));
  EXPECT_THAT(
      error([](Bench& b) { b.master_config.mutable_profile()->mutable_tx()->RemoveLast(); }),
      HasSubstr("lacks object 6077"));
  EXPECT_THAT(error([](Bench& b) {
                for (int i = 0; i < 60; ++i)
                  *b.master_config.add_drive() = b.master_config.drive(0);
              }),
              HasSubstr("do not fit one frame; at most 51 do"));
}

TEST(EthercatMaster, NamesTheStateThatASlaveRefuses) {
  Bench bench(2);
  bench.Build();
  bench.master->Start();
  SlaveAccess& slave = bench.master->slave(1);
  slave.ChangeState(AlState::kInit);
  const std::string error = ErrorOf([&] { slave.ChangeState(AlState::kOp); });
  EXPECT_THAT(error, AllOf(HasSubstr("slave 1 (station 1002, joint_1)"),
                           HasSubstr("0x0011 (invalid requested state change)")));
  slave.ChangeState(AlState::kPreOp);  // acknowledges the error first
  EXPECT_EQ(slave.ReadAlStatus().state, AlState::kPreOp);
}

TEST(EthercatMaster, SdoReachesObjectsAndNamesAborts) {
  Bench bench(1);
  bench.Start();
  SlaveAccess& slave = bench.master->slave(0);
  EXPECT_EQ(slave.Upload({0x1000, 0}), 0x00020192U);
  EXPECT_EQ(slave.Upload({0x1018, 4}), 100U);
  EXPECT_THAT(ErrorOf([&] {
                slave.Upload({0x5555, 0});
              }),
              AllOf(HasSubstr("reading object 5555:00"), HasSubstr("0x06020000")));
  EXPECT_THAT(ErrorOf([&] { slave.Upload({0x1018, 9}); }), HasSubstr("subindex does not exist"));
  EXPECT_THAT(ErrorOf([&] { slave.Download({0x1000, 0}, 1, 4); }), HasSubstr("read-only"));
  EXPECT_THAT(ErrorOf([&] { slave.Download({0x6071, 0}, 1, 4); }), HasSubstr("length"));
  EXPECT_THAT(ErrorOf([&] {
                slave.Download({0x1C12, 0}, 0, 1);
              }),
              HasSubstr("present device state"));  // not in PRE-OP
}

TEST(EthercatMaster, SdosSurviveLostFrames) {
  Bench bench(1);
  bench.master_config.set_attempts(20);
  bench.master_config.set_distributed_clocks(false);
  bench.master_config.set_mailbox_timeout(10'000);
  bench.master_config.set_watchdog(6000);
  bench.Build();
  bench.faulty->set_faults({.lost_out = 0.1, .lost_back = 0.1, .late = 0.05});
  bench.master->Start();
  for (uint32_t i = 0; i < 200; ++i) {
    // Each value is written once and read once, whatever was lost.
    bench.master->slave(0).Download({object::kTargetPosition, 0}, i, 4);
    ASSERT_EQ(bench.master->slave(0).Upload({0x1018, static_cast<uint8_t>(1 + i % 4)}),
              std::vector<uint32_t>({0x9A, 0x30924, 0x10420, 100})[i % 4]);
    ASSERT_EQ(bench.chain->slave(0).objects().Find({object::kTargetPosition, 0})->value, i);
  }
  EXPECT_GT(bench.master->counts().lost, 100);
}

TEST(EthercatMaster, EmergencyIsKeptAside) {
  Bench bench(1);
  bench.Start();
  bench.chain->slave(0).drive().TriggerFault(kErrorOverCurrent);
  bench.Cycle();
  EXPECT_EQ(bench.master->slave(0).Upload({object::kErrorCode, 0}), kErrorOverCurrent);
  EXPECT_EQ(bench.master->slave(0).last_emergency().code, kErrorOverCurrent);
}

TEST(EthercatMaster, ExchangesTorqueAndPosition) {
  Bench bench(3);
  bench.Start();
  bench.SetTorque(0, 2000);
  bench.Drive(DriveGoal::kEnabled, 20);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(bench.State(i), DriveState::kOperationEnabled);
    EXPECT_EQ(bench.master->inputs(i).mode, kModeCyclicTorque);
    DriveOutputs outputs = bench.master->outputs(i);
    outputs.target_torque = static_cast<int16_t>(-100 * static_cast<int>(i) - 100);
    bench.master->set_outputs(i, outputs);
    bench.loads[i].position_ = static_cast<double>(i) + 0.25;
    bench.loads[i].velocity_ = 2;
  }
  for (int i = 0; i < 3; ++i) bench.Cycle();
  for (size_t i = 0; i < 3; ++i) {
    const double torque = -0.1 * (static_cast<double>(i) + 1);
    EXPECT_NEAR(bench.loads[i].torque_, torque * 1.5, 1e-9);
    EXPECT_EQ(bench.master->inputs(i).torque, std::lround(torque * 1000));
    const double counts = (static_cast<double>(i) + 0.25) / 6.283185307179586 * 8192;
    EXPECT_EQ(bench.master->inputs(i).position, static_cast<int32_t>(counts));
    EXPECT_EQ(bench.master->inputs(i).velocity, static_cast<int32_t>(2 / 6.283185307179586 * 8192));
  }
}

TEST(EthercatMaster, ReadsAndWritesApart) {
  Bench bench(4);
  bench.Start();
  bench.loads[3].position_ = 1;
  bench.Cycle(Exchange::kWrite);
  EXPECT_EQ(bench.master->inputs(3).position, 0);  // not read
  const CycleResult written = bench.Cycle(Exchange::kWrite);
  EXPECT_EQ(written.working_counter, 4);
  EXPECT_TRUE(written.complete);
  const CycleResult read = bench.Cycle(Exchange::kRead);
  EXPECT_EQ(read.working_counter, 4);
  EXPECT_EQ(bench.master->inputs(3).position, 1303);
  EXPECT_EQ(bench.master->counts().lost, 0);
}

TEST(EthercatMaster, ShortWorkingCounterLeavesTheInputsAsTheyWere) {
  Bench bench(3);
  bench.Start();
  bench.Cycle();
  bench.loads[0].position_ = 1;
  bench.chain->slave(2).SetSilent(true);
  CycleResult result = bench.Cycle();
  EXPECT_TRUE(result.returned);
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.working_counter, 6);
  EXPECT_EQ(result.expected_working_counter, 9);
  EXPECT_EQ(result.slaves_answering, 2);
  EXPECT_EQ(bench.master->inputs(0).position, 0);
  EXPECT_EQ(bench.master->short_working_counters(), 1);
  bench.chain->slave(2).SetSilent(false);
  EXPECT_TRUE(bench.Cycle().complete);
  EXPECT_NE(bench.master->inputs(0).position, 0);
}

TEST(EthercatMaster, WatchdogDropsTheTorqueAndShowsInTheNextCycle) {
  Bench bench(2);
  bench.Start();
  bench.SetTorque(500, 1000);
  bench.Drive(DriveGoal::kEnabled, 20);
  ASSERT_NEAR(bench.loads[1].torque_, 0.75, 1e-9);
  const int64_t last = bench.link->Now() - bench.master_config.cycle();  // the last frame left
  bench.link->AdvanceTo(last + 49 * kMillisecond);
  EXPECT_NEAR(bench.loads[1].torque_, 0.75, 1e-9);
  bench.link->AdvanceTo(last + 51 * kMillisecond);
  EXPECT_EQ(bench.loads[0].torque_, 0);
  EXPECT_EQ(bench.loads[1].torque_, 0);
  const CycleResult result = bench.Cycle();
  EXPECT_EQ(result.working_counter, 2);  // inputs only
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(result.al_status, 0x14);  // SAFE-OP with an error
  const SlaveAccess::AlStatus status = bench.master->slave(0).ReadAlStatus();
  EXPECT_EQ(status.code, 0x001B);
  EXPECT_THAT(SlaveAccess::Text(status), HasSubstr("sync manager watchdog"));
}

TEST(EthercatMaster, CountsLostLateAndDamagedFrames) {
  Bench bench(2);
  bench.Start();
  const int64_t sent = bench.master->counts().sent;
  bench.faulty->set_faults({.lost_out = 1});
  EXPECT_FALSE(bench.Cycle().returned);
  EXPECT_EQ(bench.master->counts().lost, 1);
  bench.faulty->set_faults({.lost_back = 1});
  EXPECT_FALSE(bench.Cycle().returned);
  EXPECT_EQ(bench.master->counts().lost, 2);
  bench.faulty->set_faults({.truncated = 1});
  for (int i = 0; i < 20; ++i) bench.Cycle();
  EXPECT_GT(bench.master->counts().refused, 10);
  // A frame that comes a cycle late is not taken for this cycle's.
  bench.faulty->set_faults({.late = 1});
  EXPECT_FALSE(bench.Cycle().returned);
  bench.faulty->set_faults({});
  EXPECT_TRUE(bench.Cycle().complete);
  EXPECT_EQ(bench.master->counts().unexpected, 0);
  EXPECT_TRUE(bench.Cycle().complete);  // the late one first
  EXPECT_EQ(bench.master->counts().unexpected, 1);
  EXPECT_EQ(bench.master->counts().sent - sent, 25);
}

TEST(EthercatMaster, ADamagedOutputComesBackAsNoAnswer) {
  Bench bench(2);
  bench.Start();
  bench.SetTorque(300, 1000);
  bench.faulty->set_faults({.corrupted = 1});
  int64_t taken = 0;
  for (int i = 0; i < 2000; ++i) {
    const CycleResult result = bench.Cycle();
    taken += result.returned ? 1 : 0;
  }
  // Some of 1 to 8 bytes changed at random hit inputs, address or time alone; most are caught.
  EXPECT_LT(taken, 1200);
}

TEST(EthercatMaster, CycleAllocatesNothing) {
  Bench bench(12);
  bench.Start();
  bench.SetTorque(100, 1000);
  bench.Drive(DriveGoal::kEnabled, 20);
  // The emulation shares the process: it must not hide anything either.
  const int64_t before = AllocationCount();
  for (int i = 0; i < 100; ++i) bench.Cycle();
  for (int i = 0; i < 10; ++i) bench.Cycle(Exchange::kRead);
  EXPECT_EQ(AllocationCount(), before);
}

TEST(EthercatMaster, StrangersCannotHoldACycleUp) {
  Bench bench(1);
  bench.Start();
  // Sixteen answers of other masters' frames first.
  FrameBuilder other;
  other.AddZero(Command::kBrd, 0, 0, 0, 1);
  for (int i = 0; i < 15; ++i) ASSERT_TRUE(bench.link->Send(other.bytes()));
  EXPECT_TRUE(bench.Cycle().complete);
  EXPECT_EQ(bench.master->counts().unexpected, 15);
}

}  // namespace
}  // namespace poise::ethercat
