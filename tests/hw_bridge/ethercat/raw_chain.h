// An emulated chain that hand-made frames are sent to: what the wire shows, and no master.
#pragma once

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "hw_bridge/ethercat/links/bytes.h"
#include "tests/hw_bridge/ethercat/chain_fixture.h"

namespace poise::ethercat {

struct Answer {
  uint16_t adp = 0, working_counter = 0;
  std::vector<uint8_t> data;
  template <class T>
  T As() const {
    return Get<T>(data, 0);
  }
};

class EthercatChain : public ::testing::Test {
 protected:
  explicit EthercatChain(int drives = 3, bool build = true) : bench_(drives) {
    if (build) bench_.Build();
  }

  Answer Do(Command command, uint16_t adp, uint16_t ado, std::vector<uint8_t> data) {
    FrameBuilder builder;
    builder.Add(command, 7, adp, ado, data);
    std::vector<uint8_t> bytes(builder.bytes().begin(), builder.bytes().end());
    now_ += kMillisecond;
    EXPECT_TRUE(bench_.chain->HandleFrame(bytes, now_));
    FrameReader reader(bytes);
    const Datagram back = *reader.Next();
    EXPECT_EQ(back.index, 7);
    return {back.adp, back.working_counter, {back.data.begin(), back.data.end()}};
  }
  Answer Read(Command command, uint16_t adp, uint16_t ado, size_t size) {
    return Do(command, adp, ado, std::vector<uint8_t>(size, 0));
  }
  void AddressAll() {
    for (int i = 0; i < 3; ++i) {
      Do(Command::kApwr, AutoIncrementAddress(i), reg::kStationAddress,
         {static_cast<uint8_t>(0xE9 + i), 0x03});
    }
  }
  Answer Wait(int64_t time) {
    now_ += time;
    bench_.chain->AdvanceTo(now_);
    return Read(Command::kFprd, 1001, reg::kAlStatus, 6);
  }
  /// AL status and status code after a request for a state of the first slave.
  std::pair<int, int> Request(uint8_t state) {
    Do(Command::kFpwr, 1001, reg::kAlControl, {state, 0});
    const Answer status = Wait(20 * kMillisecond);
    return {status.data[0], Get<uint16_t>(status.data, 4)};
  }
  /// Puts a mailbox message of the first slave and takes its answer; empty: there is none.
  std::vector<uint8_t> Mailbox(std::vector<uint8_t> message) {
    message.resize(128, 0);
    EXPECT_EQ(Do(Command::kFpwr, 1001, 0x1000, message).working_counter, 1);
    Wait(2 * kMillisecond);
    return ReadMailbox();
  }
  /// The message that waits, cut to the length in its header.
  std::vector<uint8_t> ReadMailbox() {
    Answer answer = Read(Command::kFprd, 1001, 0x1080, 128);
    if (answer.working_counter == 0) return {};
    answer.data.resize(6U + Get<uint16_t>(answer.data, 0));
    return answer.data;
  }
  void ToPreOp() {
    AddressAll();
    SetUpMailbox();
    ASSERT_EQ(Request(0x02).first, 0x02);
  }
  void SetUpMailbox() {
    Do(Command::kFpwr, 1001, 0x0800, {0x00, 0x10, 0x80, 0x00, 0x26, 0x00, 0x01, 0x00});
    Do(Command::kFpwr, 1001, 0x0808, {0x80, 0x10, 0x80, 0x00, 0x22, 0x00, 0x01, 0x00});
  }

  Bench bench_;
  int64_t now_ = 0;
};

}  // namespace poise::ethercat
