// The emulated chain by hand-made frames: addresses, working counters, registers, EEPROM,
// mailboxes.
#include "tests/hw_bridge/ethercat/raw_chain.h"

namespace poise::ethercat {
namespace {

TEST_F(EthercatChain, CountsSlavesByBroadcast) {
  const Answer answer = Read(Command::kBrd, 0, reg::kAlStatus, 2);
  EXPECT_EQ(answer.working_counter, 3);
  EXPECT_EQ(answer.adp, 3);
  EXPECT_EQ(answer.data[0], 0x01);
}

// ETG.1000.4: sync managers guard buffers of the process data RAM, whatever start is written.
TEST_F(EthercatChain, NoSyncManagerGuardsRegisters) {
  AddressAll();
  const auto low = static_cast<uint8_t>(reg::kAlStatus & 0xFF);
  const auto high = static_cast<uint8_t>(reg::kAlStatus >> 8);
  Do(Command::kFpwr, 1001, 0x0800, {low, high, 0x80, 0x00, 0x26, 0x00, 0x01, 0x00});
  EXPECT_EQ(Read(Command::kBrd, 0, reg::kAlStatus, 2).working_counter, 3);
}

TEST_F(EthercatChain, AddressesByPositionOneSlaveAndCountsUp) {
  const Answer written =
      Do(Command::kApwr, AutoIncrementAddress(1), reg::kStationAddress, {0x34, 0x12});
  EXPECT_EQ(written.working_counter, 1);
  EXPECT_EQ(written.adp, 2);  // -1 + 3
  EXPECT_EQ(Read(Command::kAprd, AutoIncrementAddress(0), reg::kStationAddress, 2).As<uint16_t>(),
            0);
  EXPECT_EQ(Read(Command::kAprd, AutoIncrementAddress(1), reg::kStationAddress, 2).As<uint16_t>(),
            0x1234);
  EXPECT_EQ(Read(Command::kAprd, AutoIncrementAddress(3), reg::kStationAddress, 2).working_counter,
            0);
}

TEST_F(EthercatChain, AddressesByStationWithoutTouchingTheAddress) {
  AddressAll();
  const Answer answer = Read(Command::kFprd, 1002, reg::kStationAddress, 2);
  EXPECT_EQ(answer.working_counter, 1);
  EXPECT_EQ(answer.adp, 1002);
  EXPECT_EQ(answer.As<uint16_t>(), 1002);
  EXPECT_EQ(Read(Command::kFprd, 999, reg::kStationAddress, 2).working_counter, 0);
}

// ESC data sheet, section I, table "working counter increment": read 1, write 1, read-write 3.
TEST_F(EthercatChain, CountsReadsWritesAndBoth) {
  AddressAll();
  EXPECT_EQ(Do(Command::kFprw, 1001, 0x0400, {0x10, 0x00}).working_counter, 3);
  const Answer old = Do(Command::kAprw, AutoIncrementAddress(0), 0x0400, {0x20, 0x00});
  EXPECT_EQ(old.working_counter, 3);
  EXPECT_EQ(old.As<uint16_t>(), 0x10);  // what was there before
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0400, 2).As<uint16_t>(), 0x20);
  EXPECT_EQ(Do(Command::kBwr, 0, 0x0400, {0x00, 0x01}).working_counter, 3);
  EXPECT_EQ(Do(Command::kBrw, 0, 0x0400, {0x0F, 0x00}).working_counter, 9);
  EXPECT_EQ(Do(Command::kNop, 0, 0x0400, {1, 2}).working_counter, 0);
  EXPECT_EQ(Do(Command::kFpwr, 1001, reg::kAlStatus, {8, 0}).working_counter, 0);  // read-only
  EXPECT_EQ(Do(Command::kFprw, 1001, reg::kAlStatus, {8, 0}).working_counter, 1);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x2FFE, 4).working_counter, 0);  // beyond the memory
}

TEST_F(EthercatChain, BroadcastReadsOrTheBytes) {
  AddressAll();
  EXPECT_EQ(Read(Command::kBrd, 0, reg::kStationAddress, 2).As<uint16_t>(), 1001 | 1002 | 1003);
}

TEST_F(EthercatChain, ReadMultipleWriteReadsOneAndWritesTheOthers) {
  AddressAll();
  Do(Command::kFpwr, 1002, 0x0400, {0x77, 0x00});
  EXPECT_EQ(Read(Command::kFrmw, 1002, 0x0400, 2).working_counter, 3);
  // The first slave was passed before the second gave its value.
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x0400, 2).As<uint16_t>(), 0);
  EXPECT_EQ(Read(Command::kFprd, 1003, 0x0400, 2).As<uint16_t>(), 0x77);
  EXPECT_EQ(Read(Command::kArmw, 0, 0x0400, 2).working_counter, 3);
  EXPECT_EQ(Read(Command::kFprd, 1003, 0x0400, 2).As<uint16_t>(), 0);
}

TEST_F(EthercatChain, LogicalAccessCountsEachSlaveWithAMappedPart) {
  AddressAll();
  // Two bytes of RAM each, written and read by every second logical byte pair.
  for (uint16_t i = 0; i < 3; ++i) {
    const auto at = static_cast<uint8_t>(2 * i);
    Do(Command::kFpwr, static_cast<uint16_t>(1001 + i), reg::kFmmu,
       {at, 0, 1, 0, 2, 0, 0, 7, 0x00, 0x12, 0, kFmmuWrite, 1, 0, 0, 0});
    Do(Command::kFpwr, static_cast<uint16_t>(1001 + i), reg::kFmmu + kFmmuSize,
       {static_cast<uint8_t>(at + 6), 0, 1, 0, 2, 0, 0, 7, 0x00, 0x12, 0, kFmmuRead, 1, 0, 0, 0});
  }
  std::vector<uint8_t> image(12, 0);
  for (size_t i = 0; i < 6; ++i) image[i] = static_cast<uint8_t>(0x10 + i);
  EXPECT_EQ(Do(Command::kLwr, 0, 1, image).working_counter, 3);
  const Answer all = Do(Command::kLrw, 0, 1, image);
  EXPECT_EQ(all.working_counter, 9);
  for (size_t i = 0; i < 6; ++i) EXPECT_EQ(all.data[6 + i], 0x10 + i);
  EXPECT_EQ(Read(Command::kLrd, 6, 1, 6).working_counter, 3);
  EXPECT_EQ(Read(Command::kLrd, 8, 1, 1).working_counter, 1);  // the second slave's first byte
  EXPECT_EQ(Read(Command::kLrd, 100, 1, 4).working_counter, 0);
  bench_.chain->slave(1).SetSilent(true);
  EXPECT_EQ(Do(Command::kLrw, 0, 1, image).working_counter, 6);
  bench_.chain->CutAfter(1);
  EXPECT_EQ(Do(Command::kLrw, 0, 1, image).working_counter, 3);
}

TEST_F(EthercatChain, EepromShowsIdentityAfterItsBusyTime) {
  AddressAll();
  Do(Command::kFpwr, 1003, reg::kEepromControl, {0x00, 0x01, 0x0A, 0x00, 0x00, 0x00});
  EXPECT_EQ(Read(Command::kFprd, 1003, reg::kEepromControl, 2).As<uint16_t>() & 0x8000, 0);
  EXPECT_EQ(Read(Command::kFprd, 1003, reg::kEepromData, 4).As<uint32_t>(), 0x00030924U);
  // Busy when looked at in the same microsecond.
  EmulatedEsc& esc = bench_.chain->slave(2).esc();
  const uint8_t read[] = {0x00, 0x01, 0x0E, 0x00, 0x00, 0x00};
  now_ += kMillisecond;
  ASSERT_TRUE(esc.Write(reg::kEepromControl, read, now_));
  std::array<uint8_t, 2> status{};
  ASSERT_TRUE(esc.Read(reg::kEepromControl, status, now_ + 99'000));
  EXPECT_EQ(status[1] & 0x80, 0x80);
  ASSERT_TRUE(esc.Read(reg::kEepromControl, status, now_ + 100'000));
  EXPECT_EQ(status[1] & 0x80, 0);
}

// ETG.2010: a check sum over the first seven words, size, version, categories.
TEST_F(EthercatChain, EepromIsWhole) {
  AddressAll();
  const auto word = [&](uint16_t at) {
    Do(Command::kFpwr, 1001, reg::kEepromControl,
       {0x00, 0x01, static_cast<uint8_t>(at), static_cast<uint8_t>(at >> 8), 0x00, 0x00});
    now_ += kMillisecond;
    return Read(Command::kFprd, 1001, reg::kEepromData, 4).As<uint16_t>();
  };
  EXPECT_EQ(word(0x07), 0x30);  // of seven words of zero
  EXPECT_EQ(word(0x3F), 1);
  const int words = (word(0x3E) + 1) * 64;  // KiBit
  std::vector<int> types;
  int at = 0x40;
  for (; at < words && word(static_cast<uint16_t>(at)) != 0xFFFF;
       at += 2 + word(static_cast<uint16_t>(at + 1))) {
    types.push_back(word(static_cast<uint16_t>(at)));
    if (types.back() == 30) {  // General: CoE details, all but upload at startup
      EXPECT_EQ(word(static_cast<uint16_t>(at + 4)) >> 8, 0x2F);
    }
    if (types.back() == 40) {  // FMMUs
      EXPECT_EQ(word(static_cast<uint16_t>(at + 2)), 0x0201);
    }
  }
  EXPECT_LT(at, words);
  EXPECT_EQ(types, (std::vector<int>{10, 30, 40, 41}));
}

TEST_F(EthercatChain, StateMachineNamesWhyItStays) {
  AddressAll();
  const auto request = [this](uint8_t state) {
    Do(Command::kFpwr, 1001, reg::kAlControl, {state, 0});
    const Answer status = Wait(20 * kMillisecond);
    return std::pair<int, int>(status.data[0], Get<uint16_t>(status.data, 4));
  };
  using Status = std::pair<int, int>;
  EXPECT_EQ(request(0x04), Status(0x11, 0x0011));  // INIT to SAFE-OP: no such way
  EXPECT_EQ(request(0x02), Status(0x11, 0x0011));  // not acknowledged: nothing changes
  EXPECT_EQ(request(0x11), Status(0x01, 0x0000));
  EXPECT_EQ(request(0x07), Status(0x11, 0x0012));
  EXPECT_EQ(request(0x13), Status(0x11, 0x0013));
  EXPECT_EQ(request(0x12), Status(0x11, 0x0016));  // no mailboxes set up
  SetUpMailbox();
  EXPECT_EQ(request(0x12), Status(0x02, 0x0000));
  EXPECT_EQ(request(0x04), Status(0x12, 0x001D));  // no outputs set up
  EXPECT_EQ(request(0x11), Status(0x01, 0x0000));  // down is always allowed
}

TEST_F(EthercatChain, MailboxTakesOneMessageAtATimeAndKeepsItsAnswer) {
  AddressAll();
  SetUpMailbox();
  Do(Command::kFpwr, 1001, reg::kAlControl, {2, 0});
  ASSERT_EQ(Wait(20 * kMillisecond).data[0], 2);
  std::vector<uint8_t> request(128, 0);
  EncodeSdo({.command = SdoCommand::kUploadRequest, .object = {0x6076, 0}}, 0, 1, request);
  EXPECT_EQ(Do(Command::kFpwr, 1001, 0x1001, request).working_counter, 0);  // not at its start
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x1000, 128).working_counter, 0);    // wrong direction
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x1080, 128).working_counter, 0);    // empty
  EXPECT_EQ(Do(Command::kFpwr, 1001, 0x1000, request).working_counter, 1);
  Wait(kMillisecond);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x080D, 1).data[0] & 0x08, 0x08);  // full
  const Answer answer = Read(Command::kFprd, 1001, 0x1080, 128);
  ASSERT_EQ(answer.working_counter, 1);
  const Sdo sdo = DecodeCoe(DecodeMailbox(answer.data)->payload)->sdo;
  EXPECT_EQ(sdo.command, SdoCommand::kUploadResponse);
  EXPECT_TRUE(sdo.expedited);
  EXPECT_EQ(GetSized(sdo.data, 0, sdo.data.size()), 1500U);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x1080, 128).working_counter, 0);  // read once

  // The same counter again is the same message: no second answer.
  EXPECT_EQ(Do(Command::kFpwr, 1001, 0x1000, request).working_counter, 1);
  Wait(kMillisecond);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x1080, 128).working_counter, 0);

  // A toggled repeat request brings the last answer back, and is acknowledged.
  Do(Command::kFpwr, 1001, 0x080E, {0x03});
  Wait(kMillisecond);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x080F, 1).data[0] & 0x02, 0x02);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x1080, 128).data, answer.data);
}

TEST_F(EthercatChain, RefusesWhatIsNoFrame) {
  std::vector<uint8_t> bytes = {0x0E, 0x10, 0x07};
  EXPECT_FALSE(bench_.chain->HandleFrame(bytes, 0));
  EXPECT_EQ(bench_.chain->refused(), 1);
  EXPECT_EQ(bench_.chain->frames(), 0);
}

}  // namespace
}  // namespace poise::ethercat
