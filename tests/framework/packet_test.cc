// The raw checks, one kind of damage at a time.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "components/framework/bus/collected_channel.h"
#include "components/framework/bus/inbox.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/component.h"
#include "components/framework/run.h"

namespace poise {
namespace {

constexpr int64_t kPacketRun = 77;

std::vector<uint8_t> Packet(int64_t tick, double value = 1, int64_t run_id = kPacketRun,
                            int32_t joints = 3) {
  robot_sensors_t message;
  MessageTraits<robot_sensors_t>::Resize(message, std::vector<int32_t>{joints, 2});
  message.run_id = run_id;
  message.tick = tick;
  message.joint_position[0] = value;
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

class PacketFilterTest : public ::testing::Test {
 protected:
  PacketVerdict Check(const std::vector<uint8_t>& bytes) {
    return filter_.Check(bytes.data(), bytes.size(), 10, 20);
  }
  PacketFilter filter_{robot_sensors_t::getHash(), static_cast<int>(Packet(0).size()),
                       std::vector<int32_t>{3, 2}, kPacketRun};
};

TEST_F(PacketFilterTest, AcceptsTheWindowOnly) {
  EXPECT_EQ(Check(Packet(9)), PacketVerdict::kStaleTick);
  EXPECT_EQ(Check(Packet(10)), PacketVerdict::kAccepted);
  EXPECT_EQ(Check(Packet(20)), PacketVerdict::kAccepted);
  EXPECT_EQ(Check(Packet(21)), PacketVerdict::kFutureTick);
  EXPECT_EQ(Check(Packet(-1)), PacketVerdict::kStaleTick);
  EXPECT_EQ(Check(Packet(INT64_MIN)), PacketVerdict::kStaleTick);
  EXPECT_EQ(Check(Packet(INT64_MAX)), PacketVerdict::kFutureTick);
  EXPECT_EQ(filter_.tick(Packet(15).data()), 15);
}

TEST_F(PacketFilterTest, RefusesEverySizeButTheRightOne) {
  const std::vector<uint8_t> right = Packet(15);
  for (size_t size = 0; size < right.size() + 8; ++size) {
    std::vector<uint8_t> bytes = right;
    bytes.resize(size);
    bytes.shrink_to_fit();  // own block of this size: overruns show under the sanitizer
    EXPECT_EQ(Check(bytes),
              size == right.size() ? PacketVerdict::kAccepted : PacketVerdict::kWrongSize);
  }
}

TEST_F(PacketFilterTest, RefusesEveryDamagedByteOfTheHeader) {
  const auto expected = [](size_t byte) {
    if (byte < 8) return PacketVerdict::kWrongFingerprint;
    if (byte < 16) return PacketVerdict::kWrongCounts;
    return PacketVerdict::kWrongRun;
  };
  for (size_t byte = 0; byte < 24; ++byte) {
    for (int bit = 0; bit < 8; ++bit) {
      std::vector<uint8_t> bytes = Packet(15);
      bytes[byte] = static_cast<uint8_t>(bytes[byte] ^ (1 << bit));
      EXPECT_EQ(Check(bytes), expected(byte)) << byte;
    }
  }
  EXPECT_EQ(Check(Packet(15, 1, kPacketRun + 1)), PacketVerdict::kWrongRun);
  EXPECT_EQ(Check(Packet(15, 1, kPacketRun, 4)), PacketVerdict::kWrongSize);
}

TEST(PacketFilterNames, EveryVerdictHasAName) {
  for (int i = 0; i < static_cast<int>(PacketVerdict::kNumVerdicts); ++i) {
    EXPECT_STRNE(ToString(static_cast<PacketVerdict>(i)), "unknown");
  }
}

class InboxTest : public ::testing::Test {
 protected:
  InboxTest() {
    wiring_.AddInput(&input_, "in", {3, 2});
    inbox_ = std::make_unique<Inbox>(&input_, kPacketRun);
  }
  void Offer(const std::vector<uint8_t>& bytes) { inbox_->Offer(bytes.data(), bytes.size()); }
  int64_t Count(PacketVerdict verdict) const { return inbox_->counters().count(verdict); }
  double Shown() {
    inbox_->Show(false);
    return input_.present() ? input_->joint_position[0] : -1;
  }
  Input<robot_sensors_t> input_;
  Wiring wiring_;
  std::unique_ptr<Inbox> inbox_;
};

TEST_F(InboxTest, JoinsByTickWhateverTheOrderOfArrival) {
  for (const int64_t tick : {2, 0, 3, 1}) Offer(Packet(tick, 10.0 + static_cast<double>(tick)));
  for (int64_t tick = 0; tick < 4; ++tick) {
    inbox_->Want(tick);
    ASSERT_TRUE(inbox_->ready());
    EXPECT_EQ(Shown(), 10.0 + static_cast<double>(tick));
    EXPECT_EQ(input_->tick, tick);
  }
  inbox_->Want(4);
  EXPECT_FALSE(inbox_->ready());
  EXPECT_EQ(Shown(), -1);
  Offer(Packet(4, 14));
  EXPECT_TRUE(inbox_->ready());
  EXPECT_EQ(Shown(), 14);
}

TEST_F(InboxTest, AnEarlyMessageDoesNotShowBeforeItsTick) {
  inbox_->Want(0);
  Offer(Packet(0, 5));
  inbox_->Show(false);
  Offer(Packet(1, 6));
  EXPECT_EQ(input_->joint_position[0], 5);
}

TEST_F(InboxTest, CountsAGapOncePerWantedMessage) {
  inbox_->Want(0);
  inbox_->CountGap();
  inbox_->CountGap();
  EXPECT_EQ(inbox_->gaps(), 1);
  inbox_->Want(1);
  inbox_->CountGap();
  EXPECT_EQ(inbox_->gaps(), 2);
}

TEST(CollectedChannelTest, AMessageThatIsNotFiniteDoesNotTakeThePlaceOfTheRightOne) {
  Channel channel;
  channel.set_name("SENSORS");
  channel.set_type("robot_sensors_t");
  channel.add_count(3);
  channel.add_count(2);
  CollectedChannel collected(channel, kPacketRun);
  const std::vector<uint8_t> bad = Packet(0, NAN);
  const std::vector<uint8_t> good = Packet(0, 5);
  EXPECT_EQ(collected.Offer(bad.data(), bad.size()), PacketVerdict::kNotFinite);
  EXPECT_EQ(collected.Next(), nullptr);
  EXPECT_EQ(collected.Offer(good.data(), good.size()), PacketVerdict::kAccepted);
  ASSERT_NE(collected.Next(), nullptr);
  EXPECT_EQ(std::memcmp(collected.Next(), good.data(), good.size()), 0);
  EXPECT_EQ(collected.counters().refused(), 1);
}

TEST_F(InboxTest, CountsDuplicatesAndRefusesASecondDifferentMessage) {
  inbox_->Want(0);
  Offer(Packet(0, 5));
  Offer(Packet(0, 5));
  Offer(Packet(0, 6));
  Offer(Packet(1, 7));
  Offer(Packet(1, 8));
  EXPECT_EQ(inbox_->duplicates(), 1);
  EXPECT_EQ(Count(PacketVerdict::kConflicting), 2);
  EXPECT_EQ(inbox_->counters().refused(), 2);
  EXPECT_EQ(Shown(), 5);
  inbox_->Want(1);
  EXPECT_EQ(Shown(), 7);
  Offer(Packet(0, 5));  // late duplicate
  EXPECT_EQ(inbox_->duplicates(), 2);
}

TEST_F(InboxTest, AMessageWithABadNumberDoesNotTakeThePlaceOfTheRightOne) {
  inbox_->Want(0);
  Offer(Packet(0, std::nan("")));
  Offer(Packet(1, HUGE_VAL));
  EXPECT_EQ(Count(PacketVerdict::kNotFinite), 2);
  EXPECT_FALSE(inbox_->ready());
  Offer(Packet(0, 5));
  Offer(Packet(1, 6));
  EXPECT_EQ(Shown(), 5);
  inbox_->Want(1);
  EXPECT_EQ(Shown(), 6);
}

TEST_F(InboxTest, KeepsAWindowAheadAndRefusesWhatLiesOutside) {
  inbox_->Want(1000);
  Offer(Packet(1000 + kReceiveWindow - 1));
  Offer(Packet(1000 + kReceiveWindow));
  Offer(Packet(999));
  Offer(Packet(1000 - kReceiveWindow - 1));
  Offer(Packet(-5));
  EXPECT_EQ(Count(PacketVerdict::kAccepted), 1);
  EXPECT_EQ(Count(PacketVerdict::kFutureTick), 1);
  EXPECT_EQ(Count(PacketVerdict::kStaleTick), 3);
  inbox_->Want(1000 + kReceiveWindow - 1);
  EXPECT_TRUE(inbox_->ready());
}

TEST(LatestInbox, ShowsTheLastMessageAndWaitsForNone) {
  Input<robot_sensors_t> input;
  Wiring wiring;
  wiring.AddInput(&input, "in", {3, 2}, InputKind::kLatest);
  Inbox inbox(&input, kPacketRun);
  EXPECT_TRUE(inbox.ready());
  inbox.Show(false);
  EXPECT_FALSE(input.present());
  for (const double value : {1.0, 2.0, std::nan("")}) {
    const std::vector<uint8_t> bytes = Packet(0, value);
    inbox.Offer(bytes.data(), bytes.size());
  }
  inbox.Show(false);
  ASSERT_TRUE(input.present());
  EXPECT_EQ(input->joint_position[0], 2);
  EXPECT_EQ(inbox.counters().refused(), 1);
}

std::vector<uint8_t> Datagram(const std::string& bytes) { return {bytes.begin(), bytes.end()}; }

TEST(ParseDatagram, ReadsLcmsShortMessages) {
  BusReceiver::Packet packet;
  const std::vector<uint8_t> good = Datagram(std::string("LC02\0\0\0\1CHANNEL\0data", 20));
  ASSERT_TRUE(ParseDatagram(good.data(), good.size(), &packet));
  EXPECT_EQ(packet.channel, "CHANNEL");
  EXPECT_EQ(std::string(packet.data, packet.data + packet.size), "data");
  const std::vector<uint8_t> empty = Datagram(std::string("LC02\0\0\0\1X\0", 10));
  ASSERT_TRUE(ParseDatagram(empty.data(), empty.size(), &packet));
  EXPECT_EQ(packet.size, 0u);
}

TEST(ParseDatagram, RefusesEverythingElse) {
  BusReceiver::Packet packet;
  for (const std::string& bad :
       {std::string(), std::string("L"), std::string("LC02"), std::string("LC02\0\0\0\1", 8),
        std::string("LC02\0\0\0\1NO_END", 14), std::string("LC03\0\0\0\1X\0data", 14),
        "LC02\1\1\1\1" + std::string(64, 'A') + std::string("\0data", 5)}) {
    const std::vector<uint8_t> bytes = Datagram(bad);
    EXPECT_FALSE(ParseDatagram(bytes.data(), bytes.size(), &packet)) << bad;
  }
}

TEST(Bus, AWrongUrlIsRefusedWithAdvice) {
  for (const char* url : {"memq://", "udpm://10.0.0.1:7667?ttl=0", "udpm://239.255.76.67:0?ttl=0",
                          "udpm://239.255.76.67:99999", "nonsense", ""}) {
    try {
      BusReceiver receiver(url);
      ADD_FAILURE() << url;
    } catch (const BusError& error) {
      EXPECT_NE(std::string(error.what()).find("write udpm://GROUP:PORT?ttl=TTL"),
                std::string::npos)
          << error.what();
    }
    EXPECT_THROW(BusSender sender(url), BusError) << url;
  }
}

TEST(Bus, WhatIsSentArrivesOnce) {
  const std::string url =
      "udpm://239.255.76.67:" + std::to_string(9000 + getpid() % 900) + "?ttl=0";
  BusReceiver receiver(url);
  BusSender sender(url);
  BusReceiver::Packet packet;
  for (uint8_t i = 0; i < 50; ++i) {
    const std::vector<uint8_t> data(static_cast<size_t>(i) * 1000,
                                    i);  // up to 49 kB in one datagram
    ASSERT_TRUE(sender.Send("X", data.data(), data.size()));
    pollfd fd{receiver.fd(), POLLIN, 0};
    ASSERT_EQ(poll(&fd, 1, 5000), 1);
    ASSERT_TRUE(receiver.Receive(&packet));
    EXPECT_EQ(packet.channel, "X");
    EXPECT_EQ(std::vector<uint8_t>(packet.data, packet.data + packet.size), data);
  }
  EXPECT_FALSE(receiver.Receive(&packet));
  EXPECT_EQ(receiver.malformed(), 0);
}

}  // namespace
}  // namespace poise
