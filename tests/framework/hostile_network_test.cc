// Hostile packets on every port of a live graph: it must stay correct and count them.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <random>

#include "tests/framework/process_harness.h"
#include "tests/framework/toy_components.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using Bytes = std::vector<uint8_t>;

/// Raw datagrams to the ports of a run, from its own socket: another's would not be looked at.
class Attacker {
 public:
  Attacker(const RunSpec& spec, const RunSocket& socket) : spec_(spec), socket_(socket.fd()) {}

  void Send(int port_offset, const Bytes& datagram) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(spec_.first_port() + port_offset));
    inet_pton(AF_INET, spec_.multicast_group().c_str(), &address.sin_addr);
    sent_ += sendto(socket_, datagram.data(), datagram.size(), 0,
                    reinterpret_cast<sockaddr*>(&address), sizeof(address)) >= 0;
  }

  /// One round: every kind of damage to every port.
  void Attack() {
    for (int port = 0; port < 2 + spec_.graph().channel_size(); ++port) {
      const std::string channel = port == 0   ? "CONTROL"
                                  : port == 1 ? "MIRROR"
                                              : spec_.graph().channel(port - 2).name();
      Send(port, Noise(random_() % 600));
      Send(port, Message(channel, Noise(random_() % 600)));
      Send(port, Message(channel, Noise(8 + random_() % 16)));
      Send(port, Message("HEALTH_PLANT", Noise(random_() % 200)));
      Send(port, Message(std::string(200, 'A'), Noise(10)));
      // Two fragments, the second with an offset that wraps: ends liblcm 1.3.1's own receiver.
      Send(port, Fragment(channel, 0));
      Send(port, Fragment(channel, 0xffffffc0));
      const Bytes whole = Message(channel, {});
      Send(port, {whole.begin(), whole.end() - 1});  // no terminating zero
      Send(port, {});
    }
    for (int i = 0; i < spec_.graph().channel_size(); ++i) {
      for (Bytes bytes : forged_[static_cast<size_t>(i)])
        Send(2 + i, Message(spec_.graph().channel(i).name(), bytes));
    }
  }

  /// Packets made from right messages: damaged number, count, run, tick, size.
  void Forge(const Messages& right) {
    for (const auto& lane : right) {
      auto& forged = forged_.emplace_back();
      if (lane.size() < 10) continue;
      const Bytes& base = lane[5];
      for (size_t byte : {size_t{0}, size_t{7}, size_t{8}, size_t{11}, size_t{12}, size_t{15}}) {
        Bytes bytes = base;
        bytes[byte] ^= 0x80;
        forged.push_back(bytes);
      }
      Bytes longer = base;
      longer.push_back(0);
      forged.push_back(longer);
      Bytes shorter = base;
      shorter.pop_back();
      forged.push_back(shorter);
    }
  }
  int64_t sent() const { return sent_; }

 private:
  Bytes Noise(size_t size) {
    Bytes bytes(size);
    for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random_());
    return bytes;
  }
  static Bytes Message(const std::string& channel, const Bytes& data) {
    std::string text("LC02\0\0\0\1", 8);
    text.append(channel).push_back('\0');
    text.append(data.begin(), data.end());
    return {text.begin(), text.end()};
  }
  /// Makes a fragment of a message of 100 bytes in two.
  static Bytes Fragment(const std::string& channel, uint32_t offset) {
    std::string text("LC03\0\0\0\x09\0\0\0\x64", 12);
    for (int shift = 24; shift >= 0; shift -= 8) text.push_back(static_cast<char>(offset >> shift));
    text.append({'\0', static_cast<char>(offset != 0), '\0', '\2'});
    text.append(channel).push_back('\0');
    text.append(0x50, 'x');
    return {text.begin(), text.end()};
  }

  const RunSpec& spec_;
  int socket_;
  std::mt19937_64 random_{TestSeed(99)};
  int64_t sent_ = 0;
  std::vector<std::vector<Bytes>> forged_;
};

TEST(HostileNetwork, ALiveGraphStaysCorrectAndCountsWhatItRefuses) {
  const RunSpec spec = ToyRun(ToyLoop(), 1500);
  const Messages expected = RunInline(spec);
  const RunSource source(spec);
  Attacker attacker(spec, source.socket());
  attacker.Forge(expected);
  HarnessOptions options;
  options.socket = &source.socket();
  options.while_running = [&] { attacker.Attack(); };
  const ProcessRun run = RunAsProcesses(spec, options);
  ASSERT_FALSE(run.timed_out);
  for (const auto& [name, code] : run.exit_codes) EXPECT_EQ(code, 0) << name;
  EXPECT_EQ(run.missing, 0);
  for (size_t channel = 0; channel < expected.size(); ++channel) {
    if (spec.graph().channel(static_cast<int>(channel)).external()) continue;
    EXPECT_TRUE(run.messages[channel] == expected[channel])
        << spec.graph().channel(static_cast<int>(channel)).name();
  }
  EXPECT_GT(attacker.sent(), 100);
  for (const auto& [name, health] : run.health) {
    EXPECT_GT(health.messages_refused, 20) << name;
    EXPECT_EQ(health.ticks_completed, 1500) << name;
  }
}

}  // namespace
}  // namespace poise
