// The drive bus over the emulated chain: joints, units, enabling, faults and the frames' bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "components/robot_files/robot_files.h"
#include "hw_bridge/drive/units.h"
#include "hw_bridge/ethercat/ethercat_drive_bus.h"
#include "tests/framework/toy_components.h"
#include "tests/hw_bridge/ethercat/chain_fixture.h"

namespace poise::ethercat {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;

constexpr int kDrives = 12;

const robot::RobotModel& Model() {
  static const robot::RobotModel model = robot::LoadRobotFiles(
      std::string(POISE_SOURCE_DIR) + "/deploy/robots/dyros/dyros_legs.pbtxt");
  return model;
}

/// Keeps the outputs of the last process data frame as bytes.
class SpyLink final : public Link {
 public:
  explicit SpyLink(Link* link) : link_(link) {}
  int64_t Now() const override { return link_->Now(); }
  bool Send(std::span<const uint8_t> frame) override {
    FrameReader reader(frame);
    const std::optional<Datagram> first = reader.Next();
    if (first && (first->command == Command::kLrw || first->command == Command::kLwr)) {
      std::copy_n(first->data.begin(), std::min(outputs_.size(), first->data.size()),
                  outputs_.begin());
    }
    return link_->Send(frame);
  }
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override {
    return link_->Receive(frame, deadline);
  }
  /// By place in the chain; 15 bytes each: 6040, 6060, 6071, 6072, 607A, 60FF.
  uint16_t controlword(size_t slave) const { return Get<uint16_t>(outputs_, 15 * slave); }
  int8_t mode(size_t slave) const { return static_cast<int8_t>(outputs_[15 * slave + 2]); }
  int16_t target_torque(size_t slave) const { return Get<int16_t>(outputs_, 15 * slave + 3); }
  uint16_t max_torque(size_t slave) const { return Get<uint16_t>(outputs_, 15 * slave + 5); }

 private:
  Link* link_;
  std::array<uint8_t, 15 * kDrives> outputs_{};
};

class EthercatBus : public ::testing::Test {
 protected:
  EthercatBus() : bench_(0) {
    // The chain runs the other way round than the joints.
    for (int i = 0; i < kDrives; ++i) {
      DriveConfig& drive = *bench_.master_config.add_drive();
      drive.set_joint(Model().joints()[static_cast<size_t>(kDrives - 1 - i)].name);
      bench_.chain_config.add_drive();
    }
    config_.set_attend(false);  // the tests count frames and look at their bytes
    command_.num_motors = kDrives;
    command_.current.assign(kDrives, 0);
    command_.enabled.assign(kDrives, 0);
  }
  static size_t Slave(size_t joint) { return kDrives - 1 - joint; }

  void Build() {
    MasterConfig partial = bench_.master_config;
    bench_.master_config = CompleteMasterConfig(partial, Model());
    bench_.Build();
    *config_.mutable_master() = partial;
    const auto open = [this](const LinkConfig&) {
      auto spy = std::make_unique<SpyLink>(bench_.faulty.get());
      spy_ = spy.get();
      return spy;
    };
    bus_ = std::make_unique<EthercatDriveBus>(open, config_, Model());
  }
  void Start() {
    Build();
    bus_->Start();
  }
  const drive_feedback_t* Cycle() {
    const int64_t start = bench_.link->Now();
    const drive_feedback_t* feedback = bus_->Receive();
    bus_->Send(command_);
    bench_.link->AdvanceTo(start + bench_.master_config.cycle());
    return feedback;
  }
  void Enable(int cycles = 30) {
    command_.enabled.assign(kDrives, 1);
    for (int i = 0; i < cycles; ++i) Cycle();
  }
  int32_t Status(size_t joint) {
    const drive_feedback_t* feedback = Cycle();
    return feedback != nullptr ? feedback->drive_status[joint] : -1;
  }
  /// As last received.
  bool ReportsEnabled(size_t joint) const {
    return bus_->reports()[joint].state == bridge_status_t::DRIVE_ENABLED;
  }

  Bench bench_;
  EthercatBusConfig config_;
  SpyLink* spy_ = nullptr;  // from the start on
  std::unique_ptr<EthercatDriveBus> bus_;
  drive_command_t command_;
};

TEST_F(EthercatBus, GivesNoTorqueUntilAllDrivesAreEnabled) {
  bench_.chain_config.mutable_drive(4)->set_transition_time(20);  // ms: a slow one
  Start();
  command_.enabled.assign(kDrives, 1);
  command_.current.assign(kDrives, 3);
  int cycles = 0;
  for (; !ReportsEnabled(Slave(4)) && cycles < 200; ++cycles) {
    for (size_t i = 0; i < kDrives; ++i) {
      ASSERT_EQ(spy_->target_torque(i), 0);
      ASSERT_EQ(spy_->max_torque(i), 0);
      ASSERT_EQ(bench_.loads[i].torque_, 0);
    }
    Cycle();
  }
  EXPECT_GT(cycles, 25);  // three transitions of 20 ms
  Cycle();
  for (size_t i = 0; i < kDrives; ++i) {
    EXPECT_EQ(spy_->controlword(i), kControlEnable);
    EXPECT_EQ(spy_->mode(i), 10);
    EXPECT_EQ(spy_->target_torque(i), 200);  // 3 A of 15 A
    EXPECT_EQ(spy_->max_torque(i), 2000);    // 30 A of 15 A
  }
}

TEST_F(EthercatBus, EnablesADriveOnlyInItsMode) {
  bench_.chain_config.mutable_drive(static_cast<int>(Slave(6)))->set_mode_time(100);
  Start();
  // Enabling is asked for well before that drive shows the mode; it is no fault.
  command_.enabled.assign(kDrives, 1);
  for (int i = 0; i < 15; ++i) {
    const drive_feedback_t* feedback = Cycle();
    ASSERT_NE(feedback, nullptr);
    EXPECT_EQ(feedback->drive_status[6], drive_feedback_t::DRIVE_DISABLED);
    EXPECT_EQ(spy_->controlword(Slave(6)), 0);
  }
  EXPECT_TRUE(ReportsEnabled(5));
  Enable(60);
  EXPECT_EQ(Status(6), drive_feedback_t::DRIVE_ENABLED);
}

TEST_F(EthercatBus, MapsJointsSignsAndZeros) {
  DriveConfig& reversed = *bench_.master_config.mutable_drive(static_cast<int>(Slave(3)));
  reversed.set_reversed(true);
  reversed.set_zero_counts(5000);
  Start();
  Enable();
  command_.current[3] = 6;
  command_.current[7] = -1.5;
  // Two turns of the motor, a hundredth of a turn clear of the count's edge.
  bench_.loads[Slave(3)].position_ = 2.00001 * 2 * std::numbers::pi;
  for (int i = 0; i < 3; ++i) Cycle();
  EXPECT_EQ(spy_->target_torque(Slave(3)), -400);
  EXPECT_EQ(spy_->target_torque(Slave(7)), -100);
  EXPECT_EQ(spy_->target_torque(Slave(0)), 0);
  // (54): the motor's torque is k_T i.
  EXPECT_NEAR(bench_.loads[Slave(3)].torque_, -0.10 * 6, 1e-9);
  EXPECT_NEAR(bench_.loads[Slave(7)].torque_, -0.10 * 1.5, 1e-9);
  const drive_feedback_t* feedback = Cycle();
  ASSERT_NE(feedback, nullptr);
  EXPECT_DOUBLE_EQ(feedback->current[3], 6);
  EXPECT_DOUBLE_EQ(feedback->current[7], -1.5);
  EXPECT_EQ(feedback->position_counts[3], 5000 - 2 * 8192);
  EXPECT_EQ(feedback->position_counts[7], 0);
  EXPECT_EQ(feedback->drive_status[3], drive_feedback_t::DRIVE_ENABLED);
}

TEST_F(EthercatBus, FollowsTheCounterBeyond32Bits) {
  Start();
  const double turns = 2147483648.0 / 8192;
  for (int i = -3; i <= 3; ++i) {
    bench_.loads[Slave(0)].position_ = (turns + i + 1e-5) * 2 * std::numbers::pi;
    Cycle();
    const drive_feedback_t* feedback = Cycle();
    ASSERT_NE(feedback, nullptr);
    EXPECT_EQ(feedback->position_counts[0], 2147483648 + 8192 * i);
  }
}

TEST_F(EthercatBus, InputsAreOfThisCycle) {
  Start();
  Cycle();
  Cycle();
  bench_.loads[Slave(2)].position_ = 1e-5 + 2 * std::numbers::pi;
  bench_.link->AdvanceTo(bench_.link->Now() + 1000);  // the drive looks at its encoder
  const drive_feedback_t* feedback = bus_->Receive();
  ASSERT_NE(feedback, nullptr);
  EXPECT_EQ(feedback->position_counts[2], 8192);
}

TEST_F(EthercatBus, ReportsFaultStoAndOtherStates) {
  Start();
  EXPECT_EQ(Status(5), drive_feedback_t::DRIVE_DISABLED);
  Enable();
  EXPECT_EQ(Status(5), drive_feedback_t::DRIVE_ENABLED);
  bench_.chain->slave(Slave(5)).drive().TriggerFault(kErrorOverCurrent);
  EXPECT_EQ(Status(5), drive_feedback_t::DRIVE_FAULT);
  EXPECT_EQ(Status(4), drive_feedback_t::DRIVE_ENABLED);
  bench_.chain->slave(Slave(4)).drive().SetSto(true);
  Cycle();
  EXPECT_EQ(Status(4), drive_feedback_t::DRIVE_FAULT);
  // Disabled, STO is no fault; the other drive's needs a reset.
  command_.enabled.assign(kDrives, 0);
  for (int i = 0; i < 5; ++i) Cycle();
  EXPECT_EQ(Status(4), drive_feedback_t::DRIVE_DISABLED);
  EXPECT_EQ(Status(5), drive_feedback_t::DRIVE_FAULT);
  bus_->RequestFaultReset();
  for (int i = 0; i < 5; ++i) Cycle();
  EXPECT_EQ(Status(5), drive_feedback_t::DRIVE_DISABLED);
}

TEST_F(EthercatBus, OneDrivesFaultLeavesTheOthersToTheSupervisor) {
  Start();
  Enable();
  command_.current.assign(kDrives, 1.5);
  for (int i = 0; i < 3; ++i) Cycle();
  bench_.chain->slave(0).drive().TriggerFault(kErrorOverCurrent);
  for (int i = 0; i < 3; ++i) Cycle();
  EXPECT_EQ(bench_.loads[0].torque_, 0);
  EXPECT_NEAR(bench_.loads[1].torque_, 0.15, 1e-9);
  // Told to disable them, the next frame does by a quick stop; torque is gone by its SYNC0.
  command_.enabled.assign(kDrives, 0);
  bus_->Send(command_);
  for (size_t i = 0; i < kDrives; ++i) {
    EXPECT_EQ(spy_->controlword(i), i == 0 ? kControlDisableVoltage : kControlQuickStop);
    EXPECT_EQ(spy_->target_torque(i), 0);
    EXPECT_EQ(spy_->max_torque(i), 0);
  }
  bench_.link->AdvanceTo(bench_.link->Now() + bench_.master_config.cycle());
  for (const TestLoad& load : bench_.loads) EXPECT_EQ(load.torque_, 0);
}

TEST_F(EthercatBus, InputsThatAreNotWholeAreNotUsed) {
  Start();
  Cycle();
  bench_.chain->slave(3).SetSilent(true);
  EXPECT_EQ(Cycle(), nullptr);
  EXPECT_EQ(bus_->health().bad_in_a_row, 1);
  bench_.chain->slave(3).SetSilent(false);
  EXPECT_NE(Cycle(), nullptr);
  EXPECT_EQ(bus_->health().bad_in_a_row, 0);
  EXPECT_EQ(bus_->health().bad_in_100, 1);
}

TEST_F(EthercatBus, IsBrokenByTooManyBadCyclesInARowOrOfAHundred) {
  Start();
  bench_.faulty->set_faults({.lost_back = 1});
  for (int i = 0; i < 4; ++i) EXPECT_EQ(Cycle(), nullptr);
  EXPECT_TRUE(bus_->health().usable);
  Cycle();
  EXPECT_FALSE(bus_->health().usable);
  EXPECT_TRUE(bus_->health().link_lost);
  bench_.faulty->set_faults({});
  for (int i = 0; i < 200; ++i) Cycle();
  EXPECT_EQ(bus_->health().bad_in_100, 0);
  EXPECT_FALSE(bus_->health().usable);  // until a reset
  bus_->RequestFaultReset();
  EXPECT_TRUE(bus_->health().usable);
}

TEST_F(EthercatBus, EveryFifthCycleBadIsTooMany) {
  Start();
  int cycle = 0;
  for (; bus_->health().usable && cycle < 300; ++cycle) {
    bench_.faulty->set_faults({.lost_back = cycle % 5 == 0 ? 1.0 : 0.0});
    Cycle();
  }
  EXPECT_EQ(bus_->health().bad_in_100, 20);
  EXPECT_EQ(cycle, 96);  // the twentieth bad one is cycle 95
}

TEST_F(EthercatBus, LinkLossEndsInTheDrivesOwnWatchdog) {
  Start();
  Enable();
  command_.current.assign(kDrives, 1.5);
  for (int i = 0; i < 3; ++i) Cycle();
  ASSERT_NEAR(bench_.loads[0].torque_, 0.15, 1e-9);
  bench_.faulty->set_faults({.lost_out = 1});
  for (int i = 0; i < 24; ++i) Cycle();  // 48 ms
  EXPECT_NEAR(bench_.loads[0].torque_, 0.15, 1e-9);
  Cycle();
  Cycle();
  for (const TestLoad& load : bench_.loads) EXPECT_EQ(load.torque_, 0);
  bench_.faulty->set_faults({});
  Cycle();
  EXPECT_EQ(bus_->health().al_status, 0x14);
}

TEST_F(EthercatBus, NeverSendsWhatIsNoNumberOrBeyondThePeak) {
  Start();
  Enable();
  command_.current.assign(kDrives, std::nan(""));
  command_.current[1] = 1e300;
  command_.current[2] = -31;
  command_.current[3] = INFINITY;
  Cycle();
  EXPECT_EQ(spy_->target_torque(Slave(0)), 0);
  EXPECT_EQ(spy_->target_torque(Slave(1)), 2000);
  EXPECT_EQ(spy_->target_torque(Slave(2)), -2000);
  EXPECT_EQ(spy_->target_torque(Slave(3)), 0);
  EXPECT_EQ(bus_->health().refused_currents, 10);
  command_.current.resize(3);
  Cycle();
  for (size_t i = 0; i < kDrives; ++i) {
    EXPECT_EQ(spy_->controlword(i), kControlQuickStop);
    EXPECT_EQ(spy_->max_torque(i), 0);
  }
}

TEST_F(EthercatBus, StopDisablesWithoutAFaultAndLeadsToInit) {
  Start();
  Enable();
  command_.current.assign(kDrives, 1.5);
  for (int i = 0; i < 3; ++i) Cycle();
  EXPECT_EQ(bus_->Stop(), "");
  for (size_t i = 0; i < kDrives; ++i) {
    EXPECT_EQ(bench_.chain->slave(i).al_state(), AlState::kInit);
    EXPECT_EQ(bench_.chain->slave(i).drive().state(), DriveState::kSwitchOnDisabled);
    EXPECT_EQ(bench_.loads[i].torque_, 0);
  }
}

TEST_F(EthercatBus, CycleAllocatesNothing) {
  Start();
  Enable();
  command_.current.assign(kDrives, 1.5);
  const int64_t before = AllocationCount();
  for (int i = 0; i < 100; ++i) Cycle();
  EXPECT_EQ(AllocationCount(), before);
}

TEST_F(EthercatBus, CorrectedCyclesBeginWithTheDrivesCycle) {
  // The reference clock runs 60 ppm fast: uncorrected, 6000 cycles of 2 ms would part by 0.72 ms.
  bench_.chain_config.mutable_drive(0)->set_clock_error(60);
  Start();
  const int64_t period = bench_.master_config.cycle();
  double worst = 0;
  for (int i = 0; i < 9000; ++i) {
    const int64_t start = bench_.link->Now();
    bench_.chain->AdvanceTo(start);
    const auto phase =
        std::remainder(static_cast<double>(bench_.chain->slave(0).esc().SystemTime()),
                       static_cast<double>(period));
    if (i >= 6000) worst = std::max(worst, std::abs(phase));
    bus_->Receive();
    bus_->Send(command_);
    bench_.link->AdvanceTo(start + period + bus_->cycle_correction());
  }
  EXPECT_LT(worst, 1000);  // ns
}

TEST_F(EthercatBus, RefusesAConfigurationThatDoesNotFitTheRobot) {
  const auto error = [&](auto change) {
    MasterConfig config = bench_.master_config;
    change(config);
    return ErrorOf([&] { CompleteMasterConfig(config, Model()); });
  };
  EXPECT_EQ(error([](MasterConfig&) {}), "");
  EXPECT_THAT(error([](MasterConfig& c) { c.mutable_drive(0)->set_joint("tail"); }),
              AllOf(HasSubstr("\"tail\""), HasSubstr("no joint of that name")));
  EXPECT_THAT(error([](MasterConfig& c) { c.mutable_drive()->RemoveLast(); }),
              HasSubstr("has no drive"));
  EXPECT_THAT(error([](MasterConfig& c) { *c.add_drive() = c.drive(0); }),
              HasSubstr("has two drives"));
  EXPECT_THAT(error([](MasterConfig& c) { c.mutable_drive(2)->set_rated_torque(1600); }),
              AllOf(HasSubstr("1600 mN·m"), HasSubstr("1500 mN·m")));
  const MasterConfig complete = CompleteMasterConfig(bench_.master_config, Model());
  EXPECT_EQ(complete.drive(0).rated_torque(), 1500U);
  EXPECT_EQ(complete.drive(0).rated_current(), 15000U);
}

}  // namespace
}  // namespace poise::ethercat
