// Mutated frames into the master and into the slaves. POISE_FUZZ_FRAMES sets how many.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "tests/hw_bridge/ethercat/chain_fixture.h"
#include "tests/test_seed.h"

namespace poise::ethercat {
namespace {

int64_t NumFrames() {
  const char* text = std::getenv("POISE_FUZZ_FRAMES");
  return text != nullptr ? std::atoll(text) : 20'000;
}

using Random = std::mt19937_64;
using Bytes = std::vector<uint8_t>;

size_t Below(size_t n, Random& random) {
  return static_cast<size_t>(random() % std::max<size_t>(n, 1));
}

/// Damages a right frame, or makes one up. Most stay frames, with other commands, addresses and
/// data.
Bytes Hostile(const Bytes& right, Random& random) {
  Bytes bytes = right;
  switch (random() % 6) {
    case 0:  // bytes at random places
      for (size_t i = 0, n = 1 + Below(8, random); i < n && !bytes.empty(); ++i) {
        bytes[Below(bytes.size(), random)] = static_cast<uint8_t>(random());
      }
      break;
    case 1:  // cut, or with a tail
      bytes.resize(Below(2 * bytes.size() + 2, random), static_cast<uint8_t>(random()));
      break;
    case 2: {  // noise of any length
      bytes.resize(Below(1600, random));
      for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
      break;
    }
    default: {  // a well-formed frame of any datagrams, addresses near the registers in use
      constexpr uint16_t kPlaces[] = {
          0x0000, 0x0010, 0x0100, 0x0120, 0x0130, 0x0400, 0x0420, 0x0440, 0x0500, 0x0502, 0x0508,
          0x0600, 0x0610, 0x0800, 0x0810, 0x0818, 0x0900, 0x0910, 0x0918, 0x0920, 0x0928, 0x0980,
          0x0981, 0x0990, 0x09A0, 0x1000, 0x1080, 0x1100, 0x1400, 0x2FFF, 0x0001, 0xFFFF};
      FrameBuilder builder;
      for (size_t i = 0, n = 1 + Below(4, random); i < n; ++i) {
        Bytes data(Below(random() % 8 == 0 ? 600 : 20, random));
        for (uint8_t& byte : data) byte = static_cast<uint8_t>(random() % 3 == 0 ? random() : 0);
        const auto adp = static_cast<uint16_t>(
            random() % 2 == 0 ? random() % 4
                              : (random() % 2 == 0 ? 1001 + random() % 4 : random()));
        builder.Add(static_cast<Command>(random() % kNumCommands), static_cast<uint8_t>(random()),
                    adp, kPlaces[Below(std::size(kPlaces), random)], data);
      }
      bytes.assign(builder.bytes().begin(), builder.bytes().end());
    }
  }
  return bytes;
}

/// Keeps the frames that are sent, to be damaged.
class RecordingLink final : public Link {
 public:
  explicit RecordingLink(Link* link) : link_(link) {}
  int64_t Now() const override { return link_->Now(); }
  bool Send(std::span<const uint8_t> frame) override {
    if (frames_.size() < 2000) frames_.emplace_back(frame.begin(), frame.end());
    return link_->Send(frame);
  }
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override {
    return link_->Receive(frame, deadline);
  }
  const std::vector<Bytes>& frames() const { return frames_; }

 private:
  Link* link_;
  std::vector<Bytes> frames_;
};

void ExpectWithinLimits(Bench& bench) {
  const EmulatedDriveConfig& config = bench.chain_config.drive(0);
  const double peak = config.peak_torque() * 1e-3 * config.rated_torque() * 1e-3;  // N·m
  for (size_t i = 0; i < bench.chain->size(); ++i) {
    ASSERT_LE(bench.loads[i].greatest_, peak);
    if (bench.chain->slave(i).drive().state() != DriveState::kOperationEnabled) {
      ASSERT_EQ(bench.loads[i].torque_, 0);
    }
  }
}

TEST(EthercatFuzz, SlavesSurviveHostileFrames) {
  Bench bench(3);
  bench.master_config.set_drift_frames(5);
  bench.Build();
  RecordingLink recording(bench.link.get());
  bench.master = std::make_unique<Master>(&recording, bench.master_config);
  bench.master->Start();
  bench.SetTorque(900, 1000);
  bench.Drive(DriveGoal::kEnabled, 20);
  const std::vector<Bytes> right = recording.frames();

  Random random(TestSeed(11));
  int64_t accepted = 0;
  const int64_t count = NumFrames();
  for (int64_t i = 0; i < count; ++i) {
    Bytes frame = Hostile(right[Below(right.size(), random)], random);
    const size_t size = frame.size();
    bench.link->AdvanceTo(bench.link->Now() + static_cast<int64_t>(random() % (2 * kMillisecond)));
    accepted += bench.chain->HandleFrame(frame, bench.link->Now()) ? 1 : 0;
    ASSERT_EQ(frame.size(), size);
    ExpectWithinLimits(bench);
    // Now and then a master brings the chain back to where frames matter most.
    if (i % 5000 == 4999) {
      static_cast<void>(ErrorOf([&] {
        bench.master->Start();
        bench.Drive(DriveGoal::kEnabled, 20);
      }));
    }
  }
  EXPECT_GT(accepted, count / 3);
  EXPECT_EQ(bench.chain->refused(), count - accepted);
  // Whatever they did: a master's start makes it a chain again.
  for (size_t i = 0; i < 3; ++i) bench.chain->slave(i).SetSilent(false);
  bench.master->Start();
  EXPECT_TRUE(bench.Cycle().complete);
}

/// Answers of a hostile bus: what the slaves said, damaged, or anything.
class HostileLink final : public Link {
 public:
  HostileLink(Link* link, Random* random) : link_(link), random_(random) {}
  void set_share(double share) { share_ = share; }
  int64_t hostile() const { return hostile_; }
  int64_t Now() const override { return link_->Now(); }
  bool Send(std::span<const uint8_t> frame) override {
    last_.assign(frame.begin(), frame.end());
    return link_->Send(frame);
  }
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override {
    size_t size = link_->Receive(frame, deadline);
    if (std::uniform_real_distribution<double>(0, 1)(*random_) >= share_) return size;
    ++hostile_;
    Bytes right(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size));
    if (right.empty()) right = last_;
    const Bytes bytes = Hostile(right, *random_);
    size = std::min(bytes.size(), frame.size());
    std::copy_n(bytes.begin(), size, frame.begin());
    return size;
  }

 private:
  Link* link_;
  Random* random_;
  double share_ = 0;
  int64_t hostile_ = 0;
  Bytes last_;
};

TEST(EthercatFuzz, MasterSurvivesHostileAnswersInCycles) {
  Bench bench(3);
  bench.master_config.set_drift_frames(5);
  bench.Build();
  Random random(TestSeed(12));
  HostileLink hostile(bench.link.get(), &random);
  bench.master = std::make_unique<Master>(&hostile, bench.master_config);
  bench.master->Start();
  bench.SetTorque(900, 1000);
  bench.Drive(DriveGoal::kEnabled, 20);
  hostile.set_share(0.5);
  const int64_t count = NumFrames();
  while (hostile.hostile() < count) {
    const CycleResult result = bench.Cycle();
    if (result.complete) {
      ASSERT_TRUE(result.returned);
      ASSERT_EQ(result.working_counter, result.expected_working_counter);
    }
    ExpectWithinLimits(bench);
  }
  hostile.set_share(0);
  bench.Cycle();
  EXPECT_TRUE(bench.Cycle().complete);
}

TEST(EthercatFuzz, StartUpEndsWithAnErrorOrWithDrives) {
  Random random(TestSeed(13));
  int64_t hostile_frames = 0;
  int started = 0, refused = 0;
  // Start-up asks for much fewer frames than cycles do; an eighth of the count is enough of them.
  while (hostile_frames < NumFrames() / 8) {
    Bench bench(2);
    bench.master_config.set_drift_frames(5);
    bench.master_config.set_mailbox_timeout(50);
    bench.master_config.set_state_timeout(50);
    bench.master_config.set_eeprom_timeout(50);
    bench.Build();
    HostileLink hostile(bench.link.get(), &random);
    hostile.set_share(std::uniform_real_distribution<double>(0, 0.02)(random));
    bench.master = std::make_unique<Master>(&hostile, bench.master_config);
    const std::string error = ErrorOf([&] { bench.master->Start(); });
    ++(error.empty() ? started : refused);
    // Until it commands otherwise, no drive has torque.
    for (const TestLoad& load : bench.loads) ASSERT_EQ(load.torque_, 0);
    ++hostile_frames;
    hostile_frames += hostile.hostile();
  }
  EXPECT_GT(started, 0);
  EXPECT_GT(refused, 0);
}

/// A mailbox message of any kind with some of its bytes changed, or any bytes.
Bytes HostileMailbox(Random& random) {
  constexpr uint16_t kIndices[] = {0x1000, 0x1008, 0x1018, 0x1600, 0x1607, 0x1C12,
                                   0x2F00, 0x6040, 0x6071, 0x6072, 0x6076, 0xFFFF};
  constexpr SdoCommand kCommands[] = {SdoCommand::kUploadRequest,
                                      SdoCommand::kDownloadRequest,
                                      SdoCommand::kUploadSegmentRequest,
                                      SdoCommand::kDownloadSegmentRequest,
                                      SdoCommand::kUploadResponse,
                                      SdoCommand::kUploadSegmentResponse,
                                      SdoCommand::kDownloadResponse,
                                      SdoCommand::kDownloadSegmentResponse,
                                      SdoCommand::kAbort};
  Bytes message(128, 0);
  Bytes data(Below(100, random));
  for (uint8_t& byte : data) byte = static_cast<uint8_t>(random());
  if (random() % 4 == 0) {
    EncodeSdoInfo({.opcode = static_cast<InfoOpcode>(random() % 9),
                   .incomplete = random() % 4 == 0,
                   .fragments_left = static_cast<uint16_t>(random() % 4),
                   .data = data},
                  static_cast<uint8_t>(random() % 8), message);
  } else {
    const bool expedited = random() % 5 != 0;
    if (expedited) data.resize(1 + random() % kExpedited);
    const Sdo sdo{.command = kCommands[Below(std::size(kCommands), random)],
                  .object = {kIndices[Below(std::size(kIndices), random)],
                             static_cast<uint8_t>(random() % 5)},
                  .complete = random() % 3 == 0,
                  .abort_code = static_cast<uint32_t>(random()),
                  .expedited = expedited,
                  .total = static_cast<uint32_t>(random() % 8 == 0 ? random() : random() % 600),
                  .toggle = random() % 2 == 0,
                  .last = random() % 2 == 0,
                  .data = data};
    if (EncodedSize(sdo) <= message.size()) {
      EncodeSdo(sdo, 0, static_cast<uint8_t>(random() % 8), message);
    }
  }
  if (random() % 2 == 0) {
    for (size_t i = 0, n = 1 + Below(6, random); i < n; ++i) {
      message[Below(random() % 2 == 0 ? 16 : message.size(), random)] =
          static_cast<uint8_t>(random());
    }
  }
  return message;
}

TEST(EthercatFuzz, SlavesSurviveHostileMailboxes) {
  Bench bench(1);
  bench.master_config.set_drift_frames(5);
  bench.Start();
  bench.SetTorque(900, 1000);
  bench.Drive(DriveGoal::kEnabled, 20);
  EmulatedEsc& esc = bench.chain->slave(0).esc();
  Random random(TestSeed(14));
  std::array<uint8_t, 128> answer{};
  int64_t taken = 0, answered = 0;
  for (int64_t i = 0, count = NumFrames(); i < count; ++i) {
    const Bytes message = HostileMailbox(random);
    taken += esc.Write(0x1000, message, bench.link->Now()) ? 1 : 0;
    bench.Cycle();
    // A master that reads now and then.
    if (random() % 4 != 0) answered += esc.Read(0x1080, answer, bench.link->Now()) ? 1 : 0;
    ExpectWithinLimits(bench);
  }
  EXPECT_GT(taken, NumFrames() / 4);
  EXPECT_GT(answered, NumFrames() / 8);
  EXPECT_TRUE(bench.Cycle().complete);
}

/// A slave's mailbox whose answers are anything.
class HostileMailboxLink final : public Link {
 public:
  HostileMailboxLink(Link* link, Random* random) : link_(link), random_(random) {}
  int64_t Now() const override { return link_->Now(); }
  bool Send(std::span<const uint8_t> frame) override { return link_->Send(frame); }
  size_t Receive(std::span<uint8_t> frame, int64_t deadline) override {
    const size_t size = link_->Receive(frame, deadline);
    const auto datagram = FrameReader(frame.first(size)).Next();
    if (!datagram || datagram->ado != 0x1080 || datagram->data.size() != 128) return size;
    const Bytes message = HostileMailbox(*random_);
    const auto at = static_cast<std::ptrdiff_t>(datagram->offset + kDatagramHeader);
    std::copy(message.begin(), message.end(), frame.begin() + at);
    frame[static_cast<size_t>(at) + message.size()] = 1;  // working counter
    ++hostile;
    return size;
  }
  int64_t hostile = 0;

 private:
  Link* link_;
  Random* random_;
};

TEST(EthercatFuzz, MasterSurvivesHostileMailboxes) {
  Bench bench(1);
  bench.Start();
  Random random(TestSeed(15));
  HostileMailboxLink hostile(bench.link.get(), &random);
  Transactions transactions(&hostile, kMillisecond, 2);
  SlaveAccess slave = bench.master->slave(0).Through(&transactions);
  const Bytes data(300, 7);
  int64_t errors = 0;
  while (hostile.hostile < NumFrames()) {
    const std::string error = ErrorOf([&] {
      switch (random() % 3) {
        case 0:
          slave.UploadBytes({0x1018, 0}, true);
          break;
        case 1:
          slave.DownloadBytes({0x2F00, 0}, data);
          break;
        default:
          slave.UploadBytes({0x1008, 0});
      }
    });
    errors += error.empty() ? 0 : 1;
  }
  EXPECT_GT(errors, 0);
}

}  // namespace
}  // namespace poise::ethercat
