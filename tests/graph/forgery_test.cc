// Messages that are right in all but their sender, beside a run: none is taken, all are told of.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>

#include "components/framework/bus/run_socket.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "logging/log_reader.h"
#include "logging/replay/compare.h"
#include "operate/act_t.hpp"
#include "poise/emergency_stop_t.hpp"
#include "poise/health_t.hpp"
#include "poise/message_traits.hpp"
#include "poise/run_control_t.hpp"
#include "tests/graph/poise_program.h"
#include "tests/other_user.h"

namespace poise {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<uint8_t>;

template <class T>
Bytes BytesOf(const T& message) {
  Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

void StoreInt64(int64_t value, uint8_t* data) {
  for (int k = 0; k < 8; ++k) {
    data[k] = static_cast<uint8_t>(static_cast<uint64_t>(value) >> (56 - 8 * k));
  }
}

/// What anyone on this machine can do: listen to all ports of a run, and send there.
class Forger {
 public:
  explicit Forger(const RunSpec& spec) : spec_(spec) {
    for (int i = 0; i < spec.graph().channel_size(); ++i) {
      ears_.push_back(std::make_unique<BusReceiver>(ChannelUrl(spec, i), OfRun(spec)));
      fds_.push_back({ears_.back()->fd(), POLLIN, 0});
    }
  }
  ~Forger() { close(socket_); }

  /// Answers every message that it hears with one of the next tick and its numbers changed, and
  /// keeps on sending commands and reports in the processes' names, until `program` has ended.
  void Forge(pid_t program) {
    const std::string alive = "/proc/" + std::to_string(program) + "/cmdline";
    while (std::ifstream(alive).peek() != std::ifstream::traits_type::eof()) {
      poll(fds_.data(), fds_.size(), 1);
      for (int i = 0; i < spec_.graph().channel_size(); ++i) Answer(i);
      Bystand();
    }
  }

 private:
  void Answer(int channel) {
    const Channel& of = spec_.graph().channel(channel);
    const auto at = static_cast<size_t>(FindMessageType(of.type())->run_id_offset);
    BusReceiver::Packet packet;
    // Few at once: whatever has come meanwhile, each channel has its turn before the run's end.
    for (int k = 0; k < 4 && ears_[static_cast<size_t>(channel)]->Receive(&packet); ++k) {
      Bytes bytes(packet.data, packet.data + packet.size);
      if (bytes.size() < at + 24) continue;
      const int64_t tick = ReadInt64(&bytes[at + 8]);
      StoreInt64(tick + 1, &bytes[at + 8]);
      if (of.name() == "JOINT_COMMAND") {
        const double torque = tick % 2 == 0 ? 10'000 : -10'000;  // N*m
        int64_t pattern = 0;
        std::memcpy(&pattern, &torque, sizeof(pattern));
        for (size_t k = at + 24; k + 8 <= bytes.size(); k += 8) StoreInt64(pattern, &bytes[k]);
      } else {
        bytes.back() ^= 1;
      }
      Send(2 + channel, of.name(), bytes);
    }
  }
  void Bystand() {
    run_control_t control{};
    control.run_id = spec_.run_id();
    control.command = run_control_t::COMMAND_STOP;
    Send(0, kControlChannel, BytesOf(control));
    for (const ComponentInstance& instance : spec_.graph().component()) {
      health_t health{};
      health.run_id = spec_.run_id();
      health.component = instance.name();
      health.state = health_t::STATE_FAILED;
      health.detail = "forged";
      Send(0, HealthChannel(instance.name()), BytesOf(health));
    }
    for (int i = 0; i < spec_.graph().channel_size(); ++i) {
      const Channel& channel = spec_.graph().channel(i);
      if (!channel.external()) continue;
      if (channel.type() == "emergency_stop_t") {
        emergency_stop_t reset{};
        reset.run_id = spec_.run_id();
        reset.reset = 1;
        Send(2 + i, channel.name(), BytesOf(reset));
      }
      if (channel.type() == "operate.act_t") {
        operate::act_t push{};
        push.run_id = spec_.run_id();
        push.id = 1;
        push.tick = 150;
        push.kind = operate::act_t::KIND_PUSH;
        push.force[1] = 2000;
        push.duration = 50;
        Send(2 + i, channel.name(), BytesOf(push));
      }
    }
  }
  void Send(int port, const std::string& channel, const Bytes& data) {
    std::string datagram("LC02\0\0\0\1", 8);
    datagram.append(channel).push_back('\0');
    datagram.append(data.begin(), data.end());
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(spec_.first_port() + port));
    inet_pton(AF_INET, spec_.multicast_group().c_str(), &address.sin_addr);
    sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&address),
           sizeof(address));
  }

  const RunSpec& spec_;
  int socket_ = socket(AF_INET, SOCK_DGRAM, 0);
  std::vector<std::unique_ptr<BusReceiver>> ears_;
  std::vector<pollfd> fds_;
};

class Forgery : public ::testing::TestWithParam<bool> {
 protected:
  RunSpec WaitForRun() {
    RunSpec spec;
    EXPECT_TRUE(WaitForLog(run_, 1));
    ReadTextProto(run_ + "/run_spec.pbtxt", &spec);
    return spec;
  }
  const RunFolder folder_;
  const std::string run_ = folder_ / "run";
};

TEST_P(Forgery, ForgedMessagesOfEveryChannelChangeNothingAndAreNamed) {
  if (GetParam() && !CanBeNobody()) GTEST_SKIP() << "only root can act as another user";
  const std::string inside = folder_ / "inline";
  // So long that the forger is there before its end.
  const std::vector<std::string> stand = {"run", StandScenario(), "--duration", "2", "--out"};
  const auto with = [&stand](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = stand;
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  ASSERT_EQ(RunPoise(with({inside, "--inline"})).exit_code, 0);
  PoiseProgram program(with({run_}));
  const RunSpec spec = WaitForRun();
  const pid_t forger = StartAs(GetParam(), [&] {
    Forger(spec).Forge(program.pid());
    return 0;
  });
  const ProgramResult result = program.Wait();
  EXPECT_EQ(ExitCodeOf(forger), 0);
  EXPECT_EQ(result.exit_code, 0) << result.output;

  const logging::LogComparison comparison =
      logging::CompareLogs(inside + "/run.lcm", run_ + "/run.lcm");
  EXPECT_TRUE(comparison.equal());
  EXPECT_EQ(comparison.ticks, 1000);
  std::string told;  // in the log
  logging::LogReader reader(run_ + "/run.lcm");
  logging::LogEvent event;
  while (reader.Next(&event)) {
    if (!event.channel.starts_with("HEALTH_")) {
      const auto external = [&](const Channel& channel) {
        return channel.external() && channel.name() == event.channel;
      };
      EXPECT_TRUE(std::ranges::none_of(spec.graph().channel(), external)) << event.channel;
      continue;
    }
    health_t health;
    ASSERT_TRUE(DecodeChecked(event.data.data(), std::ssize(event.data), &health));
    EXPECT_NE(health.detail, "forged");
    if (health.component == kRecorderName) told = health.detail;
  }
  EXPECT_THAT(told, HasSubstr("packets from outside the run: "));
  EXPECT_THAT(result.output, HasSubstr("warning: refused "));
  std::map<std::string, int64_t> counts;
  // A name of its own: a temporary's part would outlive it in the loop.
  const nlohmann::json recorder = nlohmann::json::parse(ReadAll(run_ + "/recorder.json"));
  for (const nlohmann::json& each : recorder["strangers"]) {
    counts[each["channel"].get<std::string>()] += each["packets"].get<int64_t>();
  }
  EXPECT_GT(counts[kControlChannel], 0);
  for (const Channel& channel : spec.graph().channel()) {
    // Answers of an operator: nobody asks anything here.
    if (channel.type() == "operate.answer_t") continue;
    EXPECT_GT(counts[channel.name()], 0) << channel.name();
    std::printf("%s: %ld refused\n", channel.name().c_str(),
                static_cast<long>(counts[channel.name()]));
  }
}

INSTANTIATE_TEST_SUITE_P(By, Forgery, testing::Bool(), [](const auto& info) {
  return info.param ? "AnotherUser" : "TheSameUser";
});

TEST(OpenStop, AnotherUserCanStopARunButNotEndItsStop) {
  if (!CanBeNobody()) GTEST_SKIP() << "only root can act as another user";
  const RunFolder folder;
  const std::string run = folder / "run";
  PoiseProgram program({"run", StandScenario(), "--realtime", "--duration", "60", "--out", run});
  ASSERT_TRUE(WaitForLog(run, kUnderWay));
  RunSpec spec;
  ReadTextProto(run + "/run_spec.pbtxt", &spec);
  int channel = 0;
  while (spec.graph().channel(channel).name() != "EMERGENCY_STOP") ++channel;
  const pid_t stopper = StartAs(true, [&] {
    emergency_stop_t stop{};
    stop.run_id = spec.run_id();
    stop.stop = 1;
    const Bytes bytes = BytesOf(stop);
    BusSender sender(ChannelUrl(spec, channel));
    for (int i = 0; i < 50; ++i) {
      sender.Send("EMERGENCY_STOP", bytes.data(), bytes.size());
      usleep(20'000);
    }
    return 0;
  });
  EXPECT_EQ(ExitCodeOf(stopper), 0);
  const ProgramResult again = RunPoise({"estop", run});
  EXPECT_THAT(again.output, HasSubstr("the bridge has stopped the robot"));
  kill(program.pid(), SIGINT);
  program.Wait();
  int64_t stops = 0;
  logging::LogReader reader(run + "/run.lcm");
  logging::LogEvent event;
  while (reader.Next(&event)) stops += event.channel == "EMERGENCY_STOP" ? 1 : 0;
  EXPECT_GT(stops, 0);  // a replay needs them
}

}  // namespace
}  // namespace poise
