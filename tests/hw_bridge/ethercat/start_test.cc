// What a master does to the registers of its slaves on the way to OP and back, as the wire shows
// it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/hw_bridge/ethercat/raw_chain.h"

namespace poise::ethercat {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Keeps every datagram that is sent, with its time.
class WatchLink final : public Link {
 public:
  struct Sent {
    int64_t time;
    Command command;
    uint16_t adp, ado;
    std::vector<uint8_t> data;
  };
  explicit WatchLink(Link* link) : link_(link) {}
  int64_t Now() const override { return link_->Now(); }
  bool Send(std::span<const uint8_t> frame) override {
    FrameReader reader(frame);
    while (const auto datagram = reader.Next()) {
      sent.push_back({Now(),
                      datagram->command,
                      datagram->adp,
                      datagram->ado,
                      {datagram->data.begin(), datagram->data.end()}});
    }
    return link_->Send(frame);
  }
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override {
    return link_->Receive(frame, deadline);
  }
  /// Writes to a register, by whatever command.
  std::vector<Sent> Writes(uint16_t address) const {
    std::vector<Sent> found;
    std::copy_if(sent.begin(), sent.end(), std::back_inserter(found), [&](const Sent& each) {
      return each.ado == address &&
             (each.command == Command::kBwr || each.command == Command::kFpwr);
    });
    return found;
  }
  std::vector<Sent> sent;

 private:
  Link* link_;
};

struct WatchedBench : Bench {
  explicit WatchedBench(int drives) : Bench(drives) { master_config.set_drift_frames(20); }
  void Build() {
    Bench::Build();
    watch = std::make_unique<WatchLink>(link.get());
    master = std::make_unique<Master>(watch.get(), master_config);
  }
  void Start() {
    Build();
    master->Start();
  }
  std::unique_ptr<WatchLink> watch;
};

// What another master may have left: loops and forwarding (0x0100, 0x0101), the alias as an address
// (0x0103), the event mask (0x0200), error counters (0x0300), the clock's filters (0x0934), the
// EEPROM (0x0500: forced, taken, and given to the application before PRE-OP).
TEST(EthercatStart, PutsRegistersWhereTheStandardHasThem) {
  WatchedBench bench(2);
  bench.Build();
  for (size_t i = 0; i < 2; ++i) {
    EmulatedEsc& esc = bench.chain->slave(i).esc();
    const auto leave = [&](uint16_t address, std::vector<uint8_t> bytes) {
      ASSERT_TRUE(esc.Write(address, bytes, 0)) << std::hex << address;
    };
    leave(0x0100, {0x00});
    leave(0x0103, {0x01});
    leave(0x0200, {0xFF, 0xFF});
    leave(0x0934, {0x07, 0x07});
    leave(0x0500, {0x01});
    esc.CountReceiveError(0);
  }
  bench.master->Start();
  for (size_t i = 0; i < 2; ++i) {
    EmulatedEsc& esc = bench.chain->slave(i).esc();
    const auto read = [&](uint16_t address, size_t size) {
      std::vector<uint8_t> bytes(size);
      EXPECT_TRUE(esc.Read(address, bytes, bench.link->Now()));
      return GetSized(bytes, 0, size);
    };
    EXPECT_EQ(read(0x0100, 1), 1U);
    EXPECT_EQ(read(0x0101, 1), 0U);
    EXPECT_EQ(read(0x0103, 1), 0U);
    EXPECT_EQ(read(0x0200, 2), 0x0004U);
    EXPECT_EQ(read(0x0300, 8), 0U);
    EXPECT_EQ(read(0x0930, 2), 0x1000U);
    EXPECT_EQ(read(0x0935, 1), 0x0CU);
    EXPECT_EQ(read(0x0500, 1), 1U);
  }
  const auto eeprom = bench.watch->Writes(0x0500);
  ASSERT_GE(eeprom.size(), 3U);
  EXPECT_EQ(eeprom[0].data[0], 2);
  EXPECT_EQ(eeprom[1].data[0], 0);
  // The hand-over comes before the slave is asked for PRE-OP.
  const auto states = bench.watch->Writes(0x0120);
  const auto pre_op = std::find_if(states.begin(), states.end(),
                                   [](const auto& each) { return each.data[0] == 2; });
  const auto hand_over = std::find_if(eeprom.begin(), eeprom.end(),
                                      [](const auto& each) { return each.data[0] == 1; });
  ASSERT_TRUE(pre_op != states.end() && hand_over != eeprom.end());
  EXPECT_LT(hand_over->time, pre_op->time);
}

// A master that was killed in OP leaves slaves in SAFE-OP with 0x001B, and real ones take their
// time to answer: the next start takes them from there, the first time.
TEST(EthercatStart, TakesOverFromAMasterThatWasKilledInOp) {
  WatchedBench bench(3);
  for (EmulatedDriveConfig& drive : *bench.chain_config.mutable_drive()) {
    drive.set_al_response_time(4);
  }
  bench.Start();
  bench.SetTorque(500, 1000);
  bench.Drive(DriveGoal::kEnabled, 20);
  ASSERT_NEAR(bench.loads[0].torque_, 0.75, 1e-9);
  bench.link->AdvanceTo(bench.link->Now() + kSecond);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(bench.chain->slave(i).al_state(), AlState::kSafeOp);
    ASSERT_TRUE(bench.chain->slave(i).al_error());
    EXPECT_EQ(bench.loads[i].torque_, 0);
  }
  Master next(bench.link.get(), bench.master_config);
  next.Start();
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(bench.chain->slave(i).al_state(), AlState::kOp);
    EXPECT_EQ(bench.loads[i].torque_, 0);
  }
  // While process data flow still: from OP.
  Master third(bench.link.get(), bench.master_config);
  third.Start();
  EXPECT_EQ(bench.chain->slave(2).al_state(), AlState::kOp);
}

// ETG.1000.6: the acknowledgement of an error, and the state asked for once the slave has taken it
// back; no second write before it has looked at the first.
TEST(EthercatStart, WaitsForAnAcknowledgementBeforeItAsksForMore) {
  WatchedBench bench(1);
  bench.chain_config.mutable_drive(0)->set_al_response_time(3);
  bench.Build();
  bench.master->Start();
  bench.link->AdvanceTo(bench.link->Now() + kSecond);
  ASSERT_TRUE(bench.chain->slave(0).al_error());
  bench.watch->sent.clear();
  SlaveAccess& slave = bench.master->slave(0);
  slave.RequestState(AlState::kPreOp);
  const auto writes = bench.watch->Writes(0x0120);
  ASSERT_EQ(writes.size(), 2U);
  EXPECT_EQ(writes[0].data[0], 0x14);
  EXPECT_EQ(writes[1].data[0], 0x02);
  EXPECT_GE(writes[1].time - writes[0].time, 3 * kMillisecond);
  slave.AwaitState(AlState::kPreOp, [&] { slave.Pause(); });
  // INIT may be asked for in the same write.
  bench.watch->sent.clear();
  static_cast<void>(ErrorOf([&] { slave.ChangeState(AlState::kOp); }));  // no such way: an error
  ASSERT_TRUE(bench.chain->slave(0).al_error());
  bench.watch->sent.clear();
  slave.RequestState(AlState::kInit);
  ASSERT_EQ(bench.watch->Writes(0x0120).size(), 1U);
  EXPECT_EQ(bench.watch->Writes(0x0120)[0].data[0], 0x11);
}

TEST(EthercatStart, SendsProcessDataOnceACycleOnTheWayToOp) {
  WatchedBench bench(12);
  bench.Start();
  std::vector<int64_t> times;
  for (const auto& each : bench.watch->sent) {
    if (each.command == Command::kLrw) times.push_back(each.time);
  }
  ASSERT_GT(times.size(), 10U);
  for (size_t i = 1; i < times.size(); ++i) {
    EXPECT_EQ(times[i] - times[i - 1], bench.master_config.cycle()) << i;
  }
}

TEST(EthercatStart, StopsABusWithTooFewSlavesAtOnce) {
  WatchedBench bench(4);
  bench.Start();
  bench.chain->CutAfter(2);
  bench.watch->sent.clear();
  const int64_t before = bench.link->Now();
  EXPECT_FALSE(bench.master->Stop());
  EXPECT_LE(bench.watch->Writes(0x0120).size(), 2U);
  EXPECT_LT(bench.link->Now() - before, 100 * kMillisecond);
  EXPECT_EQ(bench.chain->slave(1).al_state(), AlState::kInit);
  // One that stays where it is, is asked ten times a second.
  WatchedBench slow(1);
  slow.chain_config.mutable_drive(0)->set_al_response_time(1e5);
  slow.Build();
  slow.watch->sent.clear();
  EXPECT_TRUE(slow.master->Stop());  // it is in INIT
  EXPECT_LE(slow.watch->Writes(0x0120).size(), 1U);
}

// Register 0x092C is asked whether the clocks agree before SYNC0 is started.
TEST(EthercatStart, WaitsUntilTheClocksSayThatTheyAgree) {
  WatchedBench bench(3);
  bench.master_config.set_drift_frames(0);
  bench.master_config.set_clock_tolerance(100);
  for (int i = 0; i < 3; ++i) {
    EmulatedDriveConfig& drive = *bench.chain_config.mutable_drive(i);
    drive.set_clock_error(i == 2 ? 100 : 0);
    drive.set_clock_start(1'000'000 * i);
  }
  bench.Start();
  const auto start =
      std::find_if(bench.watch->sent.begin(), bench.watch->sent.end(), [](const auto& each) {
        return each.ado == reg::kDcActivation && !each.data.empty() && each.data[0] == 3;
      });
  const auto asked =
      std::find_if(bench.watch->sent.begin(), bench.watch->sent.end(), [](const auto& each) {
        return each.ado == reg::kDcDifference && each.command == Command::kFprd;
      });
  ASSERT_TRUE(start != bench.watch->sent.end());
  EXPECT_LT(asked->time, start->time);
  for (size_t i = 1; i < 3; ++i) {
    EXPECT_LT(std::abs(bench.chain->slave(i).esc().SystemTime() -
                       bench.chain->slave(0).esc().SystemTime()),
              1000);
  }
}

TEST(EthercatStart, SaysThatAClockDoesNotSettle) {
  WatchedBench bench(2);
  bench.master_config.set_state_timeout(100);
  bench.chain_config.mutable_drive(1)->set_clock_error(100'000);  // a broken oscillator
  bench.Build();
  EXPECT_THAT(ErrorOf([&] { bench.master->Start(); }),
              AllOf(HasSubstr("joint_1"), HasSubstr("ns off the common time (register 0x092C)")));
}

// ESC data sheet, section II: registers that masters write and clear.
TEST_F(EthercatChain, TakesWritesToMasksFiltersAndCounters) {
  AddressAll();
  EmulatedEsc& esc = bench_.chain->slave(0).esc();
  esc.CountReceiveError(0);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0300, 1).data[0], 1);
  EXPECT_EQ(Do(Command::kFpwr, 1001, 0x0300, {7}).working_counter, 1);  // any value clears
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0300, 1).data[0], 0);
  EXPECT_EQ(Do(Command::kFpwr, 1001, 0x0200, {0x04, 0x00}).working_counter, 1);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0200, 2).As<uint16_t>(), 4);
  EXPECT_EQ(Do(Command::kFpwr, 1001, 0x0442, {0xFF}).working_counter, 1);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0442, 1).data[0], 0);
  EXPECT_EQ(Do(Command::kFpwr, 1001, 0x0934, {0x00, 0x0C}).working_counter, 1);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0934, 2).As<uint16_t>(), 0x0C00);
  // A cut cable is counted by the port that lost its link.
  bench_.chain->CutAfter(1);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0311, 1).data[0], 1);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0110, 2).As<uint16_t>() & 0x0800, 0);
}

TEST_F(EthercatChain, GivesItsAliasAnAddressWhenToldTo) {
  bench_.chain_config.mutable_drive(2)->set_alias(77);
  bench_.Build();
  EXPECT_EQ(Read(Command::kFprd, 77, 0x0012, 2).working_counter, 0);
  Do(Command::kBwr, 0, 0x0103, {1});
  EXPECT_EQ(Read(Command::kFprd, 77, 0x0012, 2).As<uint16_t>(), 77);
}

// ETG.1020, explicit device identification: AL control bit 5 asks, AL status bit 5 says that the
// AL status code is the number.
TEST_F(EthercatChain, GivesItsIdentificationWhenAsked) {
  bench_.chain_config.mutable_drive(0)->set_identification(42);
  bench_.Build();
  AddressAll();
  EXPECT_EQ(Request(0x21), (std::pair<int, int>(0x21, 42)));
  EXPECT_EQ(Request(0x01), (std::pair<int, int>(0x01, 0)));
}

}  // namespace
}  // namespace poise::ethercat
