// Who can send as a run: those who have been given its socket, and nobody else.
#include "components/framework/bus/run_socket.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include "components/framework/bus/stranger_watch.h"
#include "components/framework/run.h"
#include "poise/emergency_stop_t.hpp"
#include "tests/framework/toy_components.h"
#include "tests/other_user.h"

namespace poise {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// "CHANNEL" of each message that arrives within a short time.
std::vector<std::string> Heard(BusReceiver* receiver) {
  std::vector<std::string> heard;
  pollfd fd{receiver->fd(), POLLIN, 0};
  BusReceiver::Packet packet;
  while (poll(&fd, 1, 100) > 0) {
    while (receiver->Receive(&packet)) heard.emplace_back(packet.channel);
  }
  return heard;
}

/// Whether a socket can be bound to an address and the port, however it asks.
bool CanBind(int family, const char* address, int port) {
  for (const int option : {0, SO_REUSEADDR, SO_REUSEPORT}) {
    const int fd = socket(family, SOCK_DGRAM, 0);
    const int one = 1;
    if (option != 0) setsockopt(fd, SOL_SOCKET, option, &one, sizeof(one));
    sockaddr_in v4{};
    v4.sin_family = AF_INET;
    v4.sin_port = htons(static_cast<uint16_t>(port));
    sockaddr_in6 v6{};
    v6.sin6_family = AF_INET6;
    v6.sin6_port = v4.sin_port;
    const bool old = family == AF_INET;
    inet_pton(family, address, old ? static_cast<void*>(&v4.sin_addr) : &v6.sin6_addr);
    const bool bound =
        fd >= 0 &&
        bind(fd, old ? reinterpret_cast<sockaddr*>(&v4) : reinterpret_cast<sockaddr*>(&v6),
             old ? sizeof(v4) : sizeof(v6)) == 0;
    close(fd);
    if (bound) return true;
  }
  return false;
}

class RunSocketTest : public ::testing::Test {
 protected:
  RunSpec spec = ToyRun(ToyLoop(), 1);
  RunSource source{spec};
};

TEST_F(RunSocketTest, TheKernelGivesItsPortToNobodyElse) {
  EXPECT_THROW(RunSource second(spec), BusError);
  for (const bool nobody : {false, true}) {
    if (nobody && !CanBeNobody()) continue;
    EXPECT_EQ(
        ExitCodeOf(StartAs(
            nobody,
            [&] {
              int bound = 0;
              for (const char* address : {"0.0.0.0", "127.0.0.1", "127.0.0.2", "239.255.76.67"}) {
                bound += CanBind(AF_INET, address, SourcePort(spec));
              }
              for (const char* address : {"::", "::1", "::ffff:127.0.0.1"}) {
                bound += CanBind(AF_INET6, address, SourcePort(spec));
              }
              return bound;
            })),
        0);
  }
  EXPECT_TRUE(CanBind(AF_INET, "127.0.0.1", SourcePort(spec) + 1));  // the question can say yes
}

TEST_F(RunSocketTest, IsGivenToItsUserAndToNobodyElse) {
  const RunSocket asked = RunSocket::Ask(spec);
  RunSender sender(asked, ServiceUrl(spec));
  BusReceiver receiver(ServiceUrl(spec), OfRun(spec));
  const uint8_t byte = 1;
  ASSERT_TRUE(sender.Send("ASKED", &byte, 1));
  EXPECT_THAT(Heard(&receiver), ElementsAre("ASKED"));
  if (!CanBeNobody()) GTEST_SKIP() << "only root can ask as another user";
  EXPECT_EQ(ExitCodeOf(StartAs(true,
                               [&] {
                                 try {
                                   RunSocket::Ask(spec);
                                 } catch (const BusError& error) {
                                   const std::string text = error.what();
                                   return text.find("it is of user 0") != std::string::npos ? 7 : 1;
                                 }
                                 return 0;
                               })),
            7);
}

TEST_F(RunSocketTest, SaysWhenTheRunHasEnded) {
  RunSpec other = spec;
  other.set_first_port(spec.first_port() + 1);
  try {
    RunSocket::Ask(other);
    ADD_FAILURE();
  } catch (const BusError& error) {
    EXPECT_THAT(error.what(), HasSubstr("nobody gives out its socket"));
  }
  EXPECT_THROW(RunSocket(other, dup(source.socket().fd())), BusError);
}

TEST_F(RunSocketTest, ReceiversTellTheRunFromOthers) {
  BusReceiver own(ChannelUrl(spec, 0), OfRun(spec));
  BusReceiver others(ChannelUrl(spec, 0), OfOthers(spec));
  RunSender sender(source.socket(), ChannelUrl(spec, 0));
  BusSender stranger(ChannelUrl(spec, 0));
  const std::vector<uint8_t> bytes(40'000, 1);
  for (const size_t size : {size_t{0}, size_t{1}, bytes.size()}) {
    ASSERT_TRUE(sender.Send("OWN", bytes.data(), size));
    ASSERT_TRUE(stranger.Send("FORGED", bytes.data(), size));
  }
  EXPECT_THAT(Heard(&own), ElementsAre("OWN", "OWN", "OWN"));
  EXPECT_THAT(Heard(&others), ElementsAre("FORGED", "FORGED", "FORGED"));
}

TEST_F(RunSocketTest, StrangersAreCountedAndNamed) {
  StrangerWatch watch(spec, StrangerWatch::Ports::kProcesses);
  BusSender stranger(ChannelUrl(spec, 0));
  const uint8_t byte = 1;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(stranger.Send("ANYTHING", &byte, 1));
  ASSERT_TRUE(BusSender(ServiceUrl(spec)).Send("CONTROL", &byte, 1));
  RunSender own(source.socket(), ChannelUrl(spec, 0));
  ASSERT_TRUE(own.Send("ANYTHING", &byte, 1));
  const auto packets = [&] {
    int64_t all = 0;
    for (const Stranger& each : watch.strangers()) all += each.packets;
    return all;
  };
  for (int i = 0; i < 1000 && packets() < 4; ++i) {
    watch.Look();
    usleep(1000);
  }
  ASSERT_EQ(watch.strangers().size(), 2);
  EXPECT_EQ(packets(), 4);
  const std::string text = Describe(watch.strangers());
  EXPECT_THAT(text, HasSubstr("4 packets from outside the run: 3 to " +
                              spec.graph().channel(0).name() + " from "));
  EXPECT_THAT(text, HasSubstr(", 1 to CONTROL from "));
  EXPECT_EQ(Describe({}), "");
}

TEST_F(RunSocketTest, OnlyAStopIsTakenOfAll) {
  for (const Channel& channel : spec.graph().channel()) {
    EXPECT_EQ(TakesStopsOfAll(channel), channel.name() == "STOP") << channel.name();
  }
  const auto only_stops = [](int stop, int reset, size_t cut) {
    emergency_stop_t message{};
    message.stop = static_cast<int8_t>(stop);
    message.reset = static_cast<int8_t>(reset);
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    return OnlyStops({"STOP", bytes.data(), bytes.size() - cut});
  };
  EXPECT_TRUE(only_stops(1, 0, 0));
  EXPECT_FALSE(only_stops(0, 1, 0));
  EXPECT_FALSE(only_stops(1, 1, 0));
  EXPECT_FALSE(only_stops(0, 0, 0));
  EXPECT_FALSE(only_stops(1, 0, 1));
}

TEST(FileDescriptor, IsClosedOnceWithItsLastOwner) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const FileDescriptor reads = ends[0];
  const auto open = [&] { return fcntl(ends[1], F_GETFD) >= 0; };
  {
    FileDescriptor none, first = ends[1];
    EXPECT_LT(none, 0);
    FileDescriptor second = std::move(first);
    none = std::move(second);
    EXPECT_TRUE(open());
    EXPECT_EQ(none, ends[1]);
    EXPECT_LT(second, 0);
    errno = ENOENT;
  }
  EXPECT_EQ(errno, ENOENT);
  EXPECT_FALSE(open());
}

}  // namespace
}  // namespace poise
