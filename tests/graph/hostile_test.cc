// Damaged packets from a run's own socket cannot stop or change a run that is going on.
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "components/framework/bus/run_socket.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "logging/replay/compare.h"
#include "poise/health_t.hpp"
#include "poise/message_traits.hpp"
#include "tests/graph/poise_program.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

void PutInt64(int64_t value, uint8_t* data) {
  for (int k = 0; k < 8; ++k) {
    data[k] = static_cast<uint8_t>(static_cast<uint64_t>(value) >> (56 - 8 * k));
  }
}

/// Encoded health of this run with a name that is no text.
std::vector<uint8_t> StrangeHealth(int64_t run_id) {
  health_t health{};
  health.run_id = run_id;
  health.component = "\xFF\xFE\xC0";
  health.detail = "\x80 damaged";
  std::vector<uint8_t> bytes(static_cast<size_t>(health.getEncodedSize()));
  health.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Sends to every port of the run until the program ends: noise, messages of the right shape with
/// wrong runs, counts and lengths; and as many of this very run with ticks that are past or far and
/// NaN for numbers.
int64_t Attack(const RunSpec& spec, pid_t program) {
  struct Target {
    RunSender sender;
    std::string channel;
    std::vector<uint8_t> message;
    size_t run_id_offset = 0;  // 0: no message of a tick
  };
  const RunSocket socket = RunSocket::Ask(spec);
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
    targets.push_back({RunSender(socket, ChannelUrl(spec, i)), channel.name(), std::move(bytes),
                       // An operator's stop of this run would be heard.
                       channel.external() ? 0 : static_cast<size_t>(type->run_id_offset)});
  }
  targets.push_back(
      {RunSender(socket, ServiceUrl(spec)), kControlChannel, std::vector<uint8_t>(41, 0)});
  targets.push_back({RunSender(socket, ServiceUrl(spec)), "HEALTH_REDISTRIBUTOR",
                     std::vector<uint8_t>(80, 0xFF)});

  targets.push_back(
      {RunSender(socket, ServiceUrl(spec)), "HEALTH_REDISTRIBUTOR", StrangeHealth(spec.run_id())});

  std::mt19937 random(TestSeed(1));
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
      if (i % 2 == 0) {  // of this run
        if (const size_t at = target.run_id_offset; at > 0) {
          PutInt64(spec.run_id(), &bytes[at]);
          PutInt64(random() % 2 == 0 ? -1 - static_cast<int64_t>(random())
                                     : 1'000'000 + static_cast<int64_t>(random()),
                   &bytes[at + 8]);
          for (size_t k = at + 24; k < bytes.size(); ++k) bytes[k] = 0xFF;  // NaN
        }
        target.sender.Send(target.channel, bytes.data(), bytes.size());
        ++sent;
        continue;
      }
      for (size_t n = random() % 8; n > 0 && !bytes.empty(); --n) {
        bytes[random() % bytes.size()] = static_cast<uint8_t>(random());
      }
      if (random() % 4 == 0) bytes.resize(random() % (bytes.size() + 20));
      const bool own = random() % 8 != 0;
      target.sender.Send(own ? std::string_view(target.channel) : "ELSE", bytes.data(),
                         bytes.size());
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
  const nlohmann::json summary = ReadSummary(attacked);  // throws on what is no JSON
  EXPECT_GE(summary["components"].size(), 6u);
  for (const nlohmann::json& component : summary["components"]) {
    EXPECT_GT(component["refused"].get<int64_t>(), 0) << component["name"];
  }
}

}  // namespace
}  // namespace poise
