// Frame and mailbox layouts against bytes written down from the standard and from other masters.
#include "hw_bridge/ethercat/links/frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "hw_bridge/ethercat/coe.h"
#include "hw_bridge/ethercat/links/bytes.h"
#include "hw_bridge/ethercat/registers.h"

namespace poise::ethercat {
namespace {

using Bytes = std::vector<uint8_t>;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

Bytes Frame(const FrameBuilder& builder) {
  return {builder.bytes().begin(), builder.bytes().end()};
}

bool IsFrame(const Bytes& bytes) { return FrameReader(bytes).valid(); }

TEST(EthercatFrame, IsLaidOutAsTheStandardSays) {
  FrameBuilder builder;
  builder.AddZero(Command::kBrd, 0x55, 0, 0x0130, 2);
  // ETG.1000.4: length 14 and type 1; BRD, index, ADP, ADO, length, IRQ, two data bytes, WKC.
  EXPECT_THAT(Frame(builder), ElementsAreArray({0x0E, 0x10, 0x07, 0x55, 0x00, 0x00, 0x30, 0x01,
                                                0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00}));
}

TEST(EthercatFrame, ChainsDatagramsWithTheMoreBit) {
  FrameBuilder builder;
  const uint8_t data[] = {0xAA};
  builder.AddLogical(Command::kLrw, 1, 0x12345678, data);
  builder.Add(Command::kApwr, 1, AutoIncrementAddress(2), 0x0010, data);
  EXPECT_THAT(Frame(builder),
              ElementsAreArray({0x1A, 0x10,                                      // 26 bytes
                                0x0C, 0x01, 0x78, 0x56, 0x34, 0x12, 0x01, 0x80,  // more follows
                                0x00, 0x00, 0xAA, 0x00, 0x00,                    //
                                0x02, 0x01, 0xFE, 0xFF, 0x10, 0x00, 0x01, 0x00,  // position 2: -2
                                0x00, 0x00, 0xAA, 0x00, 0x00}));
  FrameReader reader(builder.bytes());
  ASSERT_TRUE(reader.valid());
  EXPECT_EQ(reader.num_datagrams(), 2);
  EXPECT_EQ(reader.Next()->logical_address(), 0x12345678U);
  EXPECT_EQ(reader.Next()->command, Command::kApwr);
  EXPECT_FALSE(reader.Next().has_value());
}

TEST(EthercatFrame, HoldsWhatEthernetCarriesAndNoMore) {
  FrameBuilder builder;
  EXPECT_FALSE(builder.AddZero(Command::kLrw, 0, 0, 0, kMaxDatagramData + 1));
  EXPECT_TRUE(builder.empty());
  EXPECT_TRUE(builder.AddZero(Command::kLrw, 0, 0, 0, kMaxDatagramData));
  EXPECT_EQ(builder.bytes().size(), 1500U);
  EXPECT_FALSE(builder.AddZero(Command::kNop, 0, 0, 0, 0));
  EXPECT_TRUE(FrameReader(builder.bytes()).valid());
}

TEST(EthercatFrame, AcceptsEthernetsPadding) {
  FrameBuilder builder;
  builder.AddZero(Command::kBrd, 0, 0, 0x0130, 2);
  Bytes bytes = Frame(builder);
  bytes.resize(46, 0xEE);
  FrameReader reader(bytes);
  EXPECT_TRUE(reader.valid());
  EXPECT_EQ(reader.size(), 16U);
}

TEST(EthercatFrame, RefusesWhatIsNone) {
  FrameBuilder builder;
  builder.AddZero(Command::kBrd, 0, 0, 0x0130, 2);
  builder.AddZero(Command::kLrd, 0, 0, 0, 4);
  const Bytes right = Frame(builder);
  EXPECT_TRUE(IsFrame(right));
  EXPECT_FALSE(IsFrame({}));
  EXPECT_FALSE(IsFrame({0x0E}));
  EXPECT_FALSE(IsFrame(Bytes(1501, 0)));
  EXPECT_FALSE(IsFrame({0x00, 0x10}));
  EXPECT_FALSE(IsFrame(Bytes(right.begin(), right.end() - 1)));
  Bytes bytes = right;
  bytes[1] = 0x40 | (bytes[1] & 0x07);  // type 4: network variables
  EXPECT_FALSE(IsFrame(bytes));
  bytes = right;
  bytes[2] = 15;
  EXPECT_FALSE(IsFrame(bytes));
  bytes = right;
  bytes[9] &= 0x7F;  // the first datagram says that it is the last
  EXPECT_FALSE(IsFrame(bytes));
  bytes = right;
  bytes[16 + 7] |= 0x80;  // the last says that more follow
  EXPECT_FALSE(IsFrame(bytes));
  bytes = right;
  bytes[16 + 6] = 0xFF;  // its data goes beyond the frame
  EXPECT_FALSE(IsFrame(bytes));
}

// A mailbox exchange that a user of another master captured (etherlab-dev, 2021-04-07, "Ethercat
// mailbox gateway"): upload of 0xF980, subindices 1 and 2, from station 1001.
TEST(EthercatMailbox, ReadsWhatAnotherMastersSlaveAnswered) {
  const Bytes expedited = {0x0a, 0x00, 0xe9, 0x03, 0x00, 0x23, 0x00, 0x30,
                           0x4b, 0x80, 0xf9, 0x01, 0x01, 0x00, 0x00, 0x00};
  const auto message = DecodeMailbox(expedited);
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->address, 1001);
  EXPECT_EQ(message->type, MailboxType::kCoe);
  EXPECT_EQ(message->counter, 2);
  const auto coe = DecodeCoe(message->payload);
  ASSERT_TRUE(coe.has_value());
  EXPECT_EQ(coe->service, CoeService::kSdoResponse);
  EXPECT_EQ(coe->sdo.command, SdoCommand::kUploadResponse);
  EXPECT_EQ(coe->sdo.object, (ObjectAddress{0xF980, 1}));
  EXPECT_TRUE(coe->sdo.expedited);
  EXPECT_THAT(coe->sdo.data, ElementsAreArray({0x01, 0x00}));

  const Bytes four_bytes = {0x0a, 0x00, 0xe9, 0x03, 0x00, 0x13, 0x00, 0x30,
                            0x43, 0x80, 0xf9, 0x02, 0xea, 0x82, 0x1e, 0x00};
  const Sdo sdo = DecodeCoe(DecodeMailbox(four_bytes)->payload)->sdo;
  EXPECT_TRUE(sdo.expedited);
  EXPECT_THAT(sdo.data, ElementsAreArray({0xEA, 0x82, 0x1E, 0x00}));

  // A normal transfer: 240 bytes of an object of 2,048, the rest in segments.
  Bytes normal = {0xfa, 0x00, 0xe9, 0x03, 0x00, 0x33, 0x00, 0x30,
                  0x41, 0x01, 0xfe, 0x00, 0x00, 0x08, 0x00, 0x00};
  normal.resize(256, 0);
  const Sdo first = DecodeCoe(DecodeMailbox(normal)->payload)->sdo;
  EXPECT_EQ(first.command, SdoCommand::kUploadResponse);
  EXPECT_FALSE(first.expedited);
  EXPECT_EQ(first.total, 2048U);
  EXPECT_EQ(first.data.size(), 240U);
}

TEST(EthercatMailbox, WritesSdosAsCanopenLaysThemOut) {
  Bytes mailbox(kSdoMessage + 2, 0xEE);
  // CiA 301: 23h is an expedited download of 4 bytes, 2Fh of one; 40h an upload, 80h an abort.
  const Bytes one = {1};
  EncodeSdo({.command = SdoCommand::kDownloadRequest,
             .object = {0x1C12, 0},
             .expedited = true,
             .total = 1,
             .data = one},
            0, 3, mailbox);
  EXPECT_THAT(mailbox, ElementsAreArray({0x0a, 0x00, 0x00, 0x00, 0x00, 0x33, 0x00, 0x20, 0x2f, 0x12,
                                         0x1c, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00}));
  EncodeSdo({.command = SdoCommand::kUploadRequest, .object = {0xF980, 2}}, 1001, 0, mailbox);
  EXPECT_THAT(mailbox, ElementsAreArray({0x0a, 0x00, 0xe9, 0x03, 0x00, 0x03, 0x00, 0x20, 0x40, 0x80,
                                         0xf9, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00}));
  // An abort is an SDO request (service 2), whoever sends it (ETG.1000.6, abort SDO transfer).
  EncodeSdo({.command = SdoCommand::kAbort, .object = {0x6076, 0}, .abort_code = 0x06010002}, 0, 7,
            mailbox);
  EXPECT_THAT(mailbox, ElementsAreArray({0x0a, 0x00, 0x00, 0x00, 0x00, 0x73, 0x00, 0x20, 0x80, 0x76,
                                         0x60, 0x00, 0x02, 0x00, 0x01, 0x06, 0x00, 0x00}));
}

TEST(EthercatMailbox, RefusesLengthsBeyondItsBytes) {
  EXPECT_FALSE(DecodeMailbox(Bytes{0x0a, 0x00, 0x00, 0x00, 0x00}).has_value());
  EXPECT_FALSE(
      DecodeMailbox(Bytes{0x0b, 0x00, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}).has_value());
  EXPECT_FALSE(DecodeCoe(Bytes(9, 0)).has_value());
}

TEST(EthercatMailbox, CountersRunFromOneToSeven) {
  uint8_t counter = 0;
  std::vector<int> seen;
  for (int i = 0; i < 9; ++i) seen.push_back(counter = NextMailboxCounter(counter));
  EXPECT_THAT(seen, ElementsAreArray({1, 2, 3, 4, 5, 6, 7, 1, 2}));
}

TEST(EthercatNames, AreTheStandards) {
  EXPECT_EQ(AlStatusText(0x001B), "sync manager watchdog");
  EXPECT_EQ(AlStatusText(0x0011), "invalid requested state change");
  EXPECT_EQ(AlStatusText(0x7777), "unknown AL status code");
  EXPECT_THAT(std::string(SdoAbortText(0x06090011)), HasSubstr("subindex does not exist"));
  EXPECT_THAT(std::string(SdoAbortText(0x08000022)), HasSubstr("device state"));
  EXPECT_EQ(SdoAbortText(1), "unknown SDO abort code");
  EXPECT_EQ(Name(AlState::kSafeOp), "SAFE-OP");
}

}  // namespace
}  // namespace poise::ethercat
