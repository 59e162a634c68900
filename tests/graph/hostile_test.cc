// Packets from outside cannot stop or change a run that is going on.
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "components/framework/configuration.h"
#include "components/framework/run.h"
#include "components/framework/udp_bus.h"
#include "logging/compare.h"
#include "poise/message_traits.hpp"
#include "tests/graph/poise_program.h"

namespace poise {
namespace {

/// Sends to every port of the run until the program ends: noise, and messages of the right shape
/// with wrong runs, ticks, counts and lengths.
int64_t Attack(const RunSpec& spec, pid_t program) {
  struct Target {
    BusSender sender;
    std::string channel;
    std::vector<uint8_t> message;
  };
  std::vector<Target> targets;
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    const Channel& channel = spec.graph().channel(i);
    const MessageType* type = FindMessageType(channel.type());
    const std::vector<int32_t> counts(channel.count().begin(), channel.count().end());
    std::vector<uint8_t> bytes(static_cast<size_t>(type->encoded_size(counts)), 0);
    for (size_t k = 0; k < 8; ++k) {
      bytes[k] = static_cast<uint8_t>(static_cast<uint64_t>(type->fingerprint) >> (56 - 8 * k));
    }
    for (size_t c = 0; c < counts.size(); ++c) {
      bytes[8 + 4 * c + 3] = static_cast<uint8_t>(counts[c]);
    }
    targets.push_back({BusSender(ChannelUrl(spec, i)), channel.name(), std::move(bytes)});
  }
  targets.push_back({BusSender(ServiceUrl(spec)), kControlChannel, std::vector<uint8_t>(41, 0)});
  targets.push_back(
      {BusSender(ServiceUrl(spec)), "HEALTH_REDISTRIBUTOR", std::vector<uint8_t>(80, 0xFF)});

  std::mt19937 random(1);
  int64_t sent = 0;
  const std::string alive = "/proc/" + std::to_string(program) + "/cmdline";
  const auto running = [&] {
    std::ifstream in(alive);
    return in.peek() != std::ifstream::traits_type::eof();
  };
  while (running()) {
    for (int i = 0; i < 50; ++i) {
      Target& target = targets[random() % targets.size()];
      std::vector<uint8_t> bytes = target.message;
      for (size_t n = random() % 8; n > 0 && !bytes.empty(); --n) {
        bytes[random() % bytes.size()] = static_cast<uint8_t>(random());
      }
      if (random() % 4 == 0) bytes.resize(random() % (bytes.size() + 20));
      const bool own = random() % 8 != 0;
      target.sender.Send(own ? target.channel.c_str() : "ELSE", bytes.data(), bytes.size());
      ++sent;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return sent;
}

TEST(Hostile, PacketsNeitherStopNorChangeARun) {
  const RunFolder folder;
  const std::string inside = folder / "inline";
  const std::string attacked = folder / "attacked";
  ASSERT_EQ(RunPoise({"run", StandScenario(), "--inline", "--out", inside}).exit_code, 0);

  PoiseProgram program({"run", StandScenario(), "--out", attacked});
  // The folder's name is not enough to know the ports: wait for the log, then read the run.
  ASSERT_TRUE(WaitForLog(attacked, 1));
  RunSpec spec;
  ReadTextProto(attacked + "/run_spec.pbtxt", &spec);
  const int64_t sent = Attack(spec, program.pid());
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_GT(sent, 100);

  const logging::LogComparison comparison =
      logging::CompareLogs(inside + "/run.lcm", attacked + "/run.lcm");
  EXPECT_TRUE(comparison.equal());
  EXPECT_EQ(comparison.ticks, 200);
  int64_t refused = 0;
  const nlohmann::json summary = ReadSummary(attacked);
  for (const nlohmann::json& component : summary["components"]) {
    refused += component["refused"].get<int64_t>();
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace poise
