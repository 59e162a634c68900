// Listening to a run in progress, which here is a locked folder and a sender on its public URL.
#include "tools/run/live_run.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <fstream>
#include <random>

#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "poise/health_t.hpp"
#include "tests/logging/log_test_support.h"
#include "tests/test_seed.h"
#include "tools/live/field_selection.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Bytes = std::vector<uint8_t>;

class LiveRunTest : public ::testing::Test {
 protected:
  void Start() {
    lock_ = open(folder.path("").c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    ASSERT_EQ(flock(lock_, LOCK_EX | LOCK_NB), 0);
  }
  void End() {
    if (lock_ >= 0) close(lock_);
    lock_ = -1;
  }
  ~LiveRunTest() override { End(); }

  void WriteSpec() {
    std::string text;
    google::protobuf::TextFormat::PrintToString(spec, &text);
    std::ofstream(folder.path("run_spec.pbtxt")) << text;
  }
  void StartOnTheBus() {
    source.emplace(ChoosePorts(Scenario(), &spec));
    WriteSpec();
    Start();
  }
  std::string Refusal() {
    try {
      LiveRun(folder.path(""), "poise log info", "poise top");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  /// "CHANNEL tick" of what arrives until `marker` (the tick of a ROBOT_STATE) comes.
  std::vector<std::string> HearUntil(LiveRun* live, int64_t marker) {
    std::vector<std::string> heard;
    bool over = false;
    for (int i = 0; i < 1000 && !over; ++i) {
      live->Spin(10, [&](const LiveMessage& message) {
        over = over || (message.channel == "ROBOT_STATE" && message.tick == marker);
        if (!over)
          heard.push_back(std::string(message.channel) + " " + std::to_string(message.tick));
      });
    }
    EXPECT_TRUE(over);
    return heard;
  }
  Bytes Message(const std::string& channel, int64_t tick) {
    const Channel& c = spec.graph().channel(logging::ChannelIndex(spec, channel));
    const MessageType& type = *FindMessageType(c.type());
    Bytes bytes = ZeroMessage(type, std::vector<int32_t>(c.count().begin(), c.count().end()));
    const auto header = static_cast<size_t>(type.run_id_offset);
    bytes[header + 7] = 42;
    for (size_t i = 0; i < 8; ++i) {
      bytes[header + 8 + i] = static_cast<uint8_t>(static_cast<uint64_t>(tick) >> (56 - 8 * i));
    }
    return bytes;
  }
  static void Send(RunSender* sender, const std::string& channel, const Bytes& bytes) {
    ASSERT_TRUE(sender->Send(channel, bytes.data(), bytes.size()));
  }

  logging::TemporaryFolder folder;
  RunSpec spec = logging::MakeTestSpec();
  std::optional<RunSource> source;

 private:
  int lock_ = -1;
};

TEST_F(LiveRunTest, KnowsWhetherARunGoesOn) {
  EXPECT_FALSE(RunInProgress(folder.path("")));
  Start();
  EXPECT_TRUE(RunInProgress(folder.path("")));
  End();
  EXPECT_FALSE(RunInProgress(folder.path("")));
  EXPECT_FALSE(RunInProgress(folder.path("nowhere")));
}

TEST_F(LiveRunTest, SaysWhyThereIsNothingToHear) {
  EXPECT_THAT(Refusal(), HasSubstr("no run goes on there"));
  spec.set_first_port(20000);
  WriteSpec();
  EXPECT_THAT(Refusal(), HasSubstr("this run has ended; look at its log: poise log info"));
  Start();
  spec.clear_first_port();
  WriteSpec();
  EXPECT_THAT(Refusal(), HasSubstr("runs inside one process, without the network"));
  spec.set_first_port(20000);
  spec.mutable_graph()->mutable_channel(0)->clear_count();
  WriteSpec();
  EXPECT_THAT(Refusal(), HasSubstr("another version"));
  EXPECT_THROW(LiveRun(folder.path("nowhere"), "x", "x"), ConfigError);
  EXPECT_THROW(LiveRun(folder.path("run_spec.pbtxt"), "x", "x"), ConfigError);
}

TEST_F(LiveRunTest, NamesAllChannels) {
  StartOnTheBus();
  const LiveRun live(folder.path(""), "x", "x");
  EXPECT_THAT(live.ChannelNames(), Contains("ROBOT_STATE"));
  EXPECT_THAT(live.ChannelNames(), Contains("HEALTH_SIM"));
  EXPECT_THAT(live.ChannelNames(), Contains("HEALTH_RECORDER"));
}

TEST_F(LiveRunTest, HandsOutTheRunsMessagesAndRefusesAllElse) {
  StartOnTheBus();
  LiveRun live(folder.path(""), "x", "x");
  RunSender sender(source->socket(), MirrorUrl(spec));
  health_t health{};
  health.run_id = 42;
  health.tick = 8;
  health.component = "sim";
  Send(&sender, "ROBOT_STATE", Message("ROBOT_STATE", 7));
  Send(&sender, "HEALTH_SIM", logging::Encode(health));
  Send(&sender, "EMERGENCY_STOP", Message("EMERGENCY_STOP", 0));
  int64_t hostile = 0;
  const auto attack = [&](const std::string& channel, Bytes bytes) {
    Send(&sender, channel, bytes);
    ++hostile;
  };
  Bytes other_run = Message("ROBOT_STATE", 7);
  other_run[static_cast<size_t>(FindMessageType("robot_state_t")->run_id_offset) + 7] = 41;
  attack("ROBOT_STATE", other_run);
  Bytes counts = Message("ROBOT_STATE", 7);
  counts[8] = 0x7f;
  attack("ROBOT_STATE", counts);
  attack("ROBOT_STATE", Message("TASK_TORQUE", 7));
  attack("NOBODY", Message("TASK_TORQUE", 7));
  health.run_id = 41;
  attack("HEALTH_SIM", logging::Encode(health));
  attack("HEALTH_SIM", {});
  attack("HEALTH_NOBODY", logging::Encode(health));
  std::mt19937 random(TestSeed(3));
  for (int i = 0; i < 100; ++i) {
    Bytes noise(random() % 600);
    for (uint8_t& byte : noise) byte = static_cast<uint8_t>(random());
    attack(i % 2 == 0 ? "ROBOT_STATE" : "HEALTH_SIM", noise);
  }
  BusSender stranger(MirrorUrl(spec));
  const Bytes forged = Message("ROBOT_STATE", 8);
  ASSERT_TRUE(stranger.Send("ROBOT_STATE", forged.data(), forged.size()));
  ++hostile;
  Send(&sender, "ROBOT_STATE", Message("ROBOT_STATE", 9));
  EXPECT_THAT(HearUntil(&live, 9),
              ElementsAre("ROBOT_STATE 7", "HEALTH_SIM 8", "EMERGENCY_STOP 0"));
  EXPECT_EQ(live.refused(), hostile);
}

}  // namespace
}  // namespace poise
