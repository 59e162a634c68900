// CoE to the letter: the slave's answers as bytes of ETG.1000.6, and the master against a slave
// that answers with such bytes, written here by hand.
#include <gmock/gmock.h>

#include <functional>

#include "tests/hw_bridge/ethercat/raw_chain.h"

namespace poise::ethercat {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using Bytes = std::vector<uint8_t>;

/// A mailbox message of CoE: its header (ETG.1000.4: length, address, channel and priority, type 3
/// and counter), then `coe`.
Bytes Message(uint8_t counter, const Bytes& coe) {
  Bytes bytes = {
      static_cast<uint8_t>(coe.size()),         static_cast<uint8_t>(coe.size() >> 8), 0, 0, 0,
      static_cast<uint8_t>(0x03 | counter << 4)};
  bytes.insert(bytes.end(), coe.begin(), coe.end());
  return bytes;
}

/// What follows the mailbox header.
Bytes Coe(const Bytes& message) {
  return message.size() < 6 ? Bytes{} : Bytes(message.begin() + 6, message.end());
}

std::string TextOf(const Bytes& bytes, size_t from) { return {bytes.begin() + from, bytes.end()}; }

class CoeSlave : public EthercatChain {
 protected:
  explicit CoeSlave(bool build = true) : EthercatChain(1, build) {}
  void SetUp() override { ToPreOp(); }
  /// The answer to a CoE request.
  Bytes Ask(const Bytes& coe) {
    counter_ = NextMailboxCounter(counter_);
    return Coe(Mailbox(Message(counter_, coe)));
  }
  uint8_t counter_ = 0;
};

// ETG.1000.6, abort SDO transfer: service 2 (SDO request), command specifier 4 (80h).
TEST_F(CoeSlave, AbortsByAnSdoRequest) {
  EXPECT_THAT(Ask({0x00, 0x20, 0x40, 0x55, 0x55, 0x00, 0, 0, 0, 0}),
              ElementsAreArray({0x00, 0x20, 0x80, 0x55, 0x55, 0x00, 0x00, 0x00, 0x02, 0x06}));
  EXPECT_THAT(Ask({0x00, 0x20, 0x23, 0x00, 0x10, 0x00, 1, 0, 0, 0}),  // 1000 is read-only
              ElementsAreArray({0x00, 0x20, 0x80, 0x00, 0x10, 0x00, 0x02, 0x00, 0x01, 0x06}));
  EXPECT_THAT(Ask({0x00, 0x20, 0xE0, 0x00, 0x10, 0x00, 0, 0, 0, 0}),  // a specifier that is none
              ElementsAreArray({0x00, 0x20, 0x80, 0x00, 0x10, 0x00, 0x01, 0x00, 0x04, 0x05}));
}

// ETG.1000.4, table 30: what cannot be answered is a mailbox error, so that no master waits.
TEST_F(CoeSlave, AnswersDamagedMessagesByMailboxErrors) {
  const auto error = [&](const Bytes& message) {
    const Bytes answer = Mailbox(message);
    return answer.size() == 10 && (answer[5] & 0x0F) == 0 ? int{answer[8]} : -1;
  };
  EXPECT_EQ(error({0x00, 0x00, 0, 0, 0, 0x13}), 6);                 // a length of 0
  EXPECT_EQ(error({0xFF, 0xFF, 0, 0, 0, 0x23, 0, 0x20}), 8);        // of more than there is
  EXPECT_EQ(error(Message(3, {0x00, 0x90, 0x40, 0x00})), 4);        // service 9
  EXPECT_EQ(error(Message(4, {0x00, 0x00, 0x40, 0x00})), 5);        // no service
  EXPECT_EQ(error(Message(5, {0x00, 0x20, 0x40, 0x00, 0x10})), 6);  // half of a request
  counter_ = 5;
  EXPECT_EQ(Ask({0x00, 0x20, 0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0})[2], 0x43);
}

TEST_F(CoeSlave, RefusesValuesOutOfRange) {
  const auto write = [&](uint16_t index, uint8_t subindex, int size, uint32_t value) {
    const Bytes answer =
        Ask({0x00, 0x20, static_cast<uint8_t>(0x23 | (4 - size) << 2), static_cast<uint8_t>(index),
             static_cast<uint8_t>(index >> 8), subindex, static_cast<uint8_t>(value),
             static_cast<uint8_t>(value >> 8), static_cast<uint8_t>(value >> 16),
             static_cast<uint8_t>(value >> 24)});
    return answer[2] == 0x80 ? Get<uint32_t>(answer, 6) : 0U;
  };
  constexpr uint32_t kRange = 0x06090030;
  EXPECT_EQ(write(0x6060, 0, 1, 99), kRange);
  EXPECT_EQ(write(0x6060, 0, 1, 8), kRange);  // 6502 has mode 10 alone
  EXPECT_EQ(write(0x6060, 0, 1, 10), 0U);
  EXPECT_EQ(write(0x605A, 0, 2, 77), kRange);
  EXPECT_EQ(write(0x605A, 0, 2, 6), 0U);
  EXPECT_EQ(write(0x1C32, 1, 2, 99), kRange);
  EXPECT_EQ(write(0x1C32, 1, 2, 2), 0U);
  EXPECT_EQ(write(0x1C32, 2, 4, 1000), kRange);
  // More entries than have been given since the mapping was taken away.
  for (uint8_t i = 1; i <= 5; ++i) EXPECT_EQ(write(0x1607, i, 4, 0x60400010), 0U);
  EXPECT_EQ(write(0x1607, 0, 1, 5), 0U);
  EXPECT_EQ(write(0x1607, 0, 1, 0), 0U);
  EXPECT_EQ(write(0x1607, 1, 4, 0x60710010), 0U);
  EXPECT_NE(write(0x1607, 0, 1, 5), 0U);
  EXPECT_EQ(write(0x1607, 0, 1, 1), 0U);
}

// ETG.1000.6, table 64: 0003h INTEGER16, 0004h INTEGER32; CiA 402 has these objects signed.
TEST_F(CoeSlave, TellsSignedObjectsBySdoInformation) {
  const auto type = [&](int index) {
    const Bytes answer = Ask({0x00, 0x80, 0x05, 0, 0, 0, static_cast<uint8_t>(index),
                              static_cast<uint8_t>(index >> 8), 0, 0});
    return answer.size() > 11 ? Get<uint16_t>(answer, 10) : uint16_t{0};
  };
  for (const int index : {0x607A, 0x60FF, 0x6064, 0x606C}) EXPECT_EQ(type(index), 4) << index;
  for (const int index : {0x605A, 0x6071, 0x6077}) EXPECT_EQ(type(index), 3) << index;
}

// A protocol that is not CoE is a mailbox error; the mailbox goes on.
TEST_F(CoeSlave, AnswersAnotherProtocolByAMailboxError) {
  Bytes eoe = {0x04, 0x00, 0, 0, 0, 0x12, 0, 0, 0, 0};  // type 2
  // ETG.1000.4: type 0, then 0001h (mailbox command) and 0002h (unsupported protocol).
  const Bytes answer = Mailbox(eoe);
  ASSERT_EQ(answer.size(), 10U);
  EXPECT_EQ(answer[5] & 0x0F, 0);
  EXPECT_THAT(Coe(answer), ElementsAreArray({0x01, 0x00, 0x02, 0x00}));
  counter_ = 1;
  EXPECT_EQ(Ask({0x00, 0x20, 0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0})[2], 0x43);
}

// A normal transfer: 41h, complete size, data; its text is longer than the four bytes of an
// expedited one.
TEST_F(CoeSlave, UploadsATextInANormalTransfer) {
  const Bytes answer = Ask({0x00, 0x20, 0x40, 0x08, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(Bytes(answer.begin(), answer.begin() + 10),
              ElementsAreArray({0x00, 0x30, 0x41, 0x08, 0x10, 0x00, 0x1A, 0x00, 0x00, 0x00}));
  EXPECT_EQ(TextOf(answer, 10), "Poise emulated servo drive");
}

class CoeSlaveWithALongName : public CoeSlave {
 protected:
  CoeSlaveWithALongName() : CoeSlave(false) {
    for (int i = 0; i < 250; ++i) name_ += static_cast<char>('a' + i % 26);
    bench_.chain_config.mutable_drive(0)->set_device_name(name_);
    bench_.Build();
  }
  std::string name_;
};

// Segments: request 60h, toggled 70h; answers with the toggle in bit 4, the last with bit 0, and in
// bits 1 to 3 how many of the least seven bytes are unused.
TEST_F(CoeSlaveWithALongName, UploadsInSegments) {
  Bytes first = Ask({0x00, 0x20, 0x40, 0x08, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_EQ(first[2], 0x41);
  EXPECT_EQ(Get<uint32_t>(first, 6), 250U);
  std::string text = TextOf(first, 10);
  EXPECT_EQ(text.size(), 112U);  // 128 of the mailbox less its headers
  const Bytes second = Ask({0x00, 0x20, 0x60, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(second[2], 0x00);
  text += TextOf(second, 3);
  EXPECT_EQ(text.size(), 231U);
  const Bytes third = Ask({0x00, 0x20, 0x70, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(third[2], 0x11);
  text += TextOf(third, 3);
  EXPECT_EQ(text, name_);
  // There is no segment after the last.
  EXPECT_EQ(Get<uint32_t>(Ask({0x00, 0x20, 0x60, 0, 0, 0, 0, 0, 0, 0}), 6), 0x05040001U);
}

TEST_F(CoeSlaveWithALongName, AbortsASegmentWhoseToggleDidNotChange) {
  Ask({0x00, 0x20, 0x40, 0x08, 0x10, 0x00, 0, 0, 0, 0});
  Ask({0x00, 0x20, 0x60, 0, 0, 0, 0, 0, 0, 0});
  const Bytes answer = Ask({0x00, 0x20, 0x60, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_THAT(answer,
              ElementsAreArray({0x00, 0x20, 0x80, 0x08, 0x10, 0x00, 0x00, 0x00, 0x03, 0x05}));
}

// Download of ten bytes: 21h with the complete size and no data, then segments of seven and three:
// 00h, and 19h: toggled (10h), four unused (8h), last (1h).
TEST_F(CoeSlave, DownloadsInSegments) {
  EXPECT_THAT(Ask({0x00, 0x20, 0x21, 0x00, 0x2F, 0x00, 0x0A, 0, 0, 0}),
              ElementsAreArray({0x00, 0x30, 0x60, 0x00, 0x2F, 0x00, 0, 0, 0, 0}));
  EXPECT_THAT(Ask({0x00, 0x20, 0x00, 'a', 'b', 'c', 'd', 'e', 'f', 'g'}),
              ElementsAreArray({0x00, 0x30, 0x20, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_THAT(Ask({0x00, 0x20, 0x19, 'h', 'i', 'j', 0, 0, 0, 0}),
              ElementsAreArray({0x00, 0x30, 0x30, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(TextOf(Ask({0x00, 0x20, 0x40, 0x00, 0x2F, 0x00, 0, 0, 0, 0}), 10), "abcdefghij");
}

// Complete access (bit 4): subindex 0 as two bytes, then the others without gaps.
TEST_F(CoeSlave, UploadsCompletely) {
  const Bytes answer = Ask({0x00, 0x20, 0x50, 0x18, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_THAT(answer, ElementsAreArray({0x00, 0x30, 0x51, 0x18, 0x10, 0x00, 0x12, 0,    0, 0,  //
                                        0x04, 0x00,                                            //
                                        0x9A, 0x00, 0x00, 0x00, 0x24, 0x09, 0x03, 0x00,        //
                                        0x20, 0x04, 0x01, 0x00, 0x64, 0x00, 0x00, 0x00}));
  // From subindex 1; from 2 there is no such thing.
  EXPECT_EQ(Ask({0x00, 0x20, 0x50, 0x18, 0x10, 0x01, 0, 0, 0, 0}).size(), 10U + 16U);
  EXPECT_EQ(Get<uint32_t>(Ask({0x00, 0x20, 0x50, 0x18, 0x10, 0x02, 0, 0, 0, 0}), 6), 0x06010000U);
}

class CoeSlaveWithoutCompleteAccess : public CoeSlave {
 protected:
  CoeSlaveWithoutCompleteAccess() : CoeSlave(false) {
    bench_.chain_config.mutable_drive(0)->set_complete_access(false);
    bench_.Build();
  }
};

TEST_F(CoeSlaveWithoutCompleteAccess, AbortsIt) {
  EXPECT_THAT(Ask({0x00, 0x20, 0x50, 0x18, 0x10, 0x00, 0, 0, 0, 0}),
              ElementsAreArray({0x00, 0x20, 0x80, 0x18, 0x10, 0x00, 0x00, 0x00, 0x01, 0x06}));
}

TEST_F(CoeSlave, HasWhatMastersLookFor) {
  struct Row {
    uint16_t index;
    uint8_t subindex, command;  // 4Fh: one byte, 4Bh: two, 43h: four
    uint32_t value;
  };
  // ETG.1000.6 and ETG.1020: error register, synchronisation by SYNC0 (2) and its cycle; CiA 402:
  // slow down on the quick stop ramp (2), 2 x 10^-3 s.
  const Row rows[] = {{0x1001, 0, 0x4F, 0},    {0x1C32, 0, 0x4F, 0x20},
                      {0x1C32, 1, 0x4B, 2},    {0x1C33, 2, 0x43, 2'000'000},
                      {0x605A, 0, 0x4B, 2},    {0x60C2, 1, 0x4F, 2},
                      {0x60C2, 2, 0x4F, 0xFD}, {0x6087, 0, 0x43, 3'000'000}};
  for (const Row& row : rows) {
    const Bytes answer = Ask({0x00, 0x20, 0x40, static_cast<uint8_t>(row.index),
                              static_cast<uint8_t>(row.index >> 8), row.subindex, 0, 0, 0, 0});
    EXPECT_EQ(answer[2], row.command) << std::hex << row.index;
    EXPECT_EQ(Get<uint32_t>(answer, 6), row.value) << std::hex << row.index;
  }
}

// SDO information (service 8): opcode 1 with list type 1 asks for all indices, 3 for an object, 5
// for an entry; an unknown object is answered by opcode 7 and an abort code.
TEST_F(CoeSlave, TellsWhatObjectsItHas) {
  const Bytes first = Ask({0x00, 0x80, 0x01, 0, 0, 0, 0x01, 0x00});
  EXPECT_EQ(Get<uint16_t>(first, 0), 0x8000);
  EXPECT_EQ(first[2] & 0x7F, 0x02);
  EXPECT_EQ(Get<uint16_t>(first, 6), 1);  // the list's type
  EXPECT_EQ(Get<uint16_t>(first, 8), 0x1000);
  int left = Get<uint16_t>(first, 4);
  for (Bytes part = first; (part[2] & 0x80) != 0; --left) {
    Wait(kMillisecond);
    part = Coe(ReadMailbox());
    ASSERT_GE(part.size(), 6U);
    EXPECT_EQ(Get<uint16_t>(part, 4), left - 1);
  }
  EXPECT_EQ(left, 0);
  const Bytes object = Ask({0x00, 0x80, 0x03, 0, 0, 0, 0x18, 0x10});
  // 1018h: a record (9) of at most subindex 4.
  EXPECT_THAT(Bytes(object.begin(), object.begin() + 12),
              ElementsAreArray({0x00, 0x80, 0x04, 0, 0, 0, 0x18, 0x10, 0x00, 0x00, 0x04, 0x09}));
  EXPECT_EQ(TextOf(object, 12), "Identity object");
  // 6071h: INTEGER16 (0003h), 16 bits, readable and writable in PRE-OP, SAFE-OP and OP, RxPDO.
  const Bytes entry = Ask({0x00, 0x80, 0x05, 0, 0, 0, 0x71, 0x60, 0x00, 0x00});
  EXPECT_THAT(Bytes(entry.begin(), entry.begin() + 16),
              ElementsAreArray({0x00, 0x80, 0x06, 0, 0, 0, 0x71, 0x60, 0x00, 0x00,  //
                                0x03, 0x00, 0x10, 0x00, 0x7F, 0x00}));
  EXPECT_THAT(Ask({0x00, 0x80, 0x03, 0, 0, 0, 0x55, 0x55}),
              ElementsAreArray({0x00, 0x80, 0x07, 0, 0, 0, 0x00, 0x00, 0x02, 0x06}));
}

TEST_F(CoeSlave, ForgetsAnUnreadEmergencyInInit) {
  bench_.chain->slave(0).drive().TriggerFault(kErrorOverCurrent);
  Wait(kMillisecond);
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x080D, 1).data[0] & 0x08, 0x08);  // it waits
  ASSERT_EQ(Request(0x01).first, 0x01);
  // The master sets its mailboxes up anew, or leaves them: either way they are empty.
  EXPECT_EQ(Read(Command::kFprd, 1001, 0x080D, 1).data[0] & 0x08, 0);
  ASSERT_EQ(Request(0x02).first, 0x02);
  EXPECT_TRUE(ReadMailbox().empty());
}

/// A link to a slave whose mailbox answers what the test says, byte for byte: a slave controller
/// with an application of a few lines.
class ScriptedSlave final : public Link {
 public:
  /// The CoE answer to a CoE request; several: one after the other.
  using Script = std::function<std::vector<Bytes>(const Bytes& request)>;
  explicit ScriptedSlave(Script script) : script_(std::move(script)) {}
  int64_t Now() const override { return now_; }
  bool Send(std::span<const uint8_t> frame) override {
    frame_.assign(frame.begin(), frame.end());
    Datagram datagram = *FrameReader(frame_).Next();
    const std::span<uint8_t> data =
        std::span(frame_).subspan(kFrameHeader + kDatagramHeader, datagram.data.size());
    bool done = true;
    if (datagram.ado == 0x0130) {
      data[0] = 2;  // PRE-OP
    } else if (datagram.ado == 0x0508) {
      const uint32_t words[] = {0x00801000, 0x00801080, 0x00000004};  // mailboxes, CoE
      Put<uint32_t>(data, 0, words[(word_ - 0x18) / 2]);
    } else if (datagram.ado == 0x0504) {
      word_ = data[0];
    } else if (datagram.ado == 0x1000) {
      const size_t length = Get<uint16_t>(data, 0);
      requests.emplace_back(data.begin() + 6, data.begin() + 6 + static_cast<long>(length));
      for (const Bytes& answer : script_(requests.back())) answers_.push_back(answer);
    } else if (datagram.ado == 0x1080) {
      done = !answers_.empty();
      if (done) {
        counter_ = NextMailboxCounter(counter_);
        const Bytes bytes = Message(counter_, answers_.front());
        answers_.erase(answers_.begin());
        std::copy(bytes.begin(), bytes.end(), data.begin());
      }
    }
    frame_[frame_.size() - 2] = done ? 1 : 0;
    return true;
  }
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override {
    now_ = std::max(now_ + 10'000, frame_.empty() ? deadline : now_);
    const size_t size = std::min(frame.size(), frame_.size());
    std::copy_n(frame_.begin(), size, frame.begin());
    frame_.clear();
    return size;
  }
  std::vector<Bytes> requests;

 private:
  Script script_;
  Bytes frame_;
  std::vector<Bytes> answers_;
  uint32_t word_ = 0;
  uint8_t counter_ = 0;
  int64_t now_ = 0;
};

/// A master's access to such a slave.
struct ScriptedAccess {
  explicit ScriptedAccess(ScriptedSlave::Script script)
      : link(std::move(script)),
        transactions(&link, kMillisecond, 3),
        slave(&transactions, {.eeprom = kSecond, .mailbox = 50 * kMillisecond, .state = kSecond},
              0) {
    EXPECT_TRUE(slave.SetUpMailbox());
  }
  ScriptedSlave link;
  Transactions transactions;
  SlaveAccess slave;
};

// Service 2 from the slave is its abort, and says so at once instead of after the timeout.
TEST(CoeMaster, TakesAnAbortForOne) {
  ScriptedAccess access([](const Bytes&) -> std::vector<Bytes> {
    return {{0x00, 0x20, 0x80, 0x55, 0x55, 0x00, 0x00, 0x00, 0x02, 0x06}};
  });
  const std::string error = ErrorOf([&] { access.slave.Upload({0x5555, 0}); });
  EXPECT_THAT(error, AllOf(HasSubstr("SDO abort 0x06020000"),
                           HasSubstr("the object does not exist in the object dictionary")));
  EXPECT_LT(access.link.Now(), 10 * kMillisecond);
}

// 41h with up to four bytes is as valid as 43h, 47h, 4Bh and 4Fh.
TEST(CoeMaster, TakesSmallObjectsInNormalTransfers) {
  ScriptedAccess access([](const Bytes&) -> std::vector<Bytes> {
    return {{0x00, 0x30, 0x41, 0x76, 0x60, 0x00, 0x04, 0, 0, 0, 0xDC, 0x05, 0x00, 0x00}};
  });
  EXPECT_EQ(access.slave.Upload({0x6076, 0}), 1500U);
  EXPECT_THAT(access.link.requests[0],
              ElementsAreArray({0x00, 0x20, 0x40, 0x76, 0x60, 0x00, 0, 0, 0, 0}));
}

TEST(CoeMaster, PutsSegmentsTogetherAndTogglesEachRequest) {
  int segment = 0;
  ScriptedAccess access([&](const Bytes& request) -> std::vector<Bytes> {
    if (request[2] == 0x40) return {{0x00, 0x30, 0x41, 0x08, 0x10, 0x00, 0x0B, 0, 0, 0}};
    if (segment++ == 0) return {{0x00, 0x30, 0x00, 'h', 'e', 'l', 'l', 'o', ' ', 's'}};
    return {{0x00, 0x30, 0x17, 'l', 'a', 'v', 'e', 0, 0, 0}};  // toggled, three unused, last
  });
  EXPECT_EQ(TextOf(access.slave.UploadBytes({0x1008, 0}), 0), "hello slave");
  EXPECT_EQ(access.link.requests[1][2], 0x60);
  EXPECT_EQ(access.link.requests[2][2], 0x70);
}

TEST(CoeMaster, DownloadsWhatDoesNotFitInSegments) {
  const Bytes data(200, 0x5A);
  size_t total = 0;
  ScriptedAccess access([&](const Bytes& request) -> std::vector<Bytes> {
    if (request[2] == 0x21) {
      EXPECT_EQ(Get<uint32_t>(request, 6), 200U);
      total = request.size() - 10;
      return {{0x00, 0x30, 0x60, 0x00, 0x2F, 0x00, 0, 0, 0, 0}};
    }
    EXPECT_EQ(request[2], 0x01);  // the last, toggle 0
    total += request.size() - 3;
    return {{0x00, 0x30, 0x20, 0, 0, 0, 0, 0, 0, 0}};
  });
  access.slave.DownloadBytes({0x2F00, 0}, data);
  EXPECT_EQ(total, 200U);
  EXPECT_EQ(access.link.requests.size(), 2U);
}

// ETG.1000.6, table 29: an expedited transfer holds 1 to 4 bytes, so nothing is a normal one of 0.
TEST(CoeMaster, DownloadsNothingAsANormalTransfer) {
  ScriptedAccess access([](const Bytes& request) -> std::vector<Bytes> {
    EXPECT_EQ(request[2], 0x21);
    EXPECT_EQ(Get<uint32_t>(request, 6), 0U);
    return {{0x00, 0x30, 0x60, 0x00, 0x2F, 0x00, 0, 0, 0, 0}};
  });
  access.slave.DownloadBytes({0x2F00, 0}, {});
  EXPECT_EQ(access.link.requests.size(), 1U);
}

TEST(CoeMaster, AsksForCompleteAccess) {
  ScriptedAccess access([](const Bytes&) -> std::vector<Bytes> {
    return {{0x00, 0x30, 0x51, 0x12, 0x1C, 0x00, 0x04, 0, 0, 0, 0x01, 0x00, 0x07, 0x16}};
  });
  EXPECT_THAT(access.slave.UploadBytes({0x1C12, 0}, true), ElementsAreArray({1, 0, 0x07, 0x16}));
  EXPECT_EQ(access.link.requests[0][2], 0x50);
}

// What comes between request and answer: an emergency, a late answer about another object.
TEST(CoeMaster, KeepsAnEmergencyAndSkipsAStrangersAnswer) {
  ScriptedAccess access([](const Bytes&) -> std::vector<Bytes> {
    return {{0x00, 0x10, 0x10, 0x23, 0x01, 0, 0, 0, 0, 0},
            {0x00, 0x30, 0x4F, 0x00, 0x10, 0x00, 7, 0, 0, 0},
            {0x00, 0x30, 0x4F, 0x01, 0x10, 0x00, 1, 0, 0, 0}};
  });
  EXPECT_EQ(access.slave.Upload({0x1001, 0}), 1U);
  EXPECT_EQ(access.slave.last_emergency().code, 0x2310);
  EXPECT_EQ(access.slave.emergencies(), 1);
}

TEST(CoeMaster, SaysWhatIsWrongWithAnAnswer) {
  const auto error = [](const std::vector<Bytes>& answers) {
    ScriptedAccess access([&](const Bytes&) { return answers; });
    return ErrorOf([&] { access.slave.UploadBytes({0x1008, 0}); });
  };
  EXPECT_THAT(error({}), HasSubstr("no answer by the timeout"));
  EXPECT_THAT(error({{0x00, 0x30, 0x41, 0x08, 0x10, 0x00, 0xFF, 0xFF, 0xFF, 0xFF}}),
              HasSubstr("it announces 4294967295 bytes"));
  EXPECT_THAT(error({{0x00, 0x30, 0x41, 0x08, 0x10, 0x00, 0x14, 0, 0, 0},
                     {0x00, 0x30, 0x01, 'a', 'b', 'c', 'd', 'e', 'f', 'g'}}),
              HasSubstr("it ends after 7 of 20 bytes"));
  EXPECT_THAT(error({{0x00, 0x30, 0x41, 0x08, 0x10, 0x00, 0x14, 0, 0, 0},
                     {0x00, 0x30, 0x10, 'a', 'b', 'c', 'd', 'e', 'f', 'g'}}),
              HasSubstr("toggle"));
}

TEST(CoeMaster, ReadsALongObjectThatItHasWritten) {
  Bench bench(1);
  bench.Start();
  SlaveAccess& slave = bench.master->slave(0);
  std::string note(300, 'n');
  slave.DownloadBytes({0x2F00, 0}, {reinterpret_cast<const uint8_t*>(note.data()), note.size()});
  EXPECT_EQ(TextOf(slave.UploadBytes({0x2F00, 0}), 0), note);
}

}  // namespace
}  // namespace poise::ethercat
