// Real sockets: EtherCAT over UDP on the loopback, raw Ethernet over a veth pair where permitted.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>

#include "hw_bridge/ethercat/links/socket_link.h"
#include "tests/hw_bridge/ethercat/chain_fixture.h"

namespace poise::ethercat {
namespace {

using ::testing::HasSubstr;

/// Serves a chain on a link from a thread of its own.
class Server {
 public:
  Server(Link* link, EmulatedChain* chain) : thread_([this, link, chain] { Run(link, chain); }) {}
  ~Server() {
    stop_ = true;
    thread_.join();
  }

 private:
  void Run(Link* link, EmulatedChain* chain) {
    std::array<uint8_t, kMaxFrame> frame;
    while (!stop_) {
      const size_t size = link->Receive(frame, link->Now() + kMillisecond);
      if (size == 0) {
        chain->AdvanceTo(link->Now());
      } else if (chain->HandleFrame(std::span(frame).first(size), link->Now())) {
        static_cast<void>(link->Send(std::span(frame).first(size)));
      }
    }
  }

  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// Starts twelve drives over real sockets, enables them, gives them torque, and stops them.
void RunDrives(Link* master_link, Link* slaves_link) {
  EmulatedChainConfig chain_config = MakeChainConfig(12);
  for (EmulatedDriveConfig& drive : *chain_config.mutable_drive()) drive.set_output_timeout(30'000);
  std::vector<TestLoad> loads(12);
  std::vector<MotorLoad*> pointers;
  for (TestLoad& load : loads) pointers.push_back(&load);
  EmulatedChain chain(chain_config, pointers);
  MasterConfig config = MakeMasterConfig(12);
  // A machine whose processors are taken may stop either side for a while: not what is tested.
  config.set_watchdog(6000);
  config.set_frame_timeout(2000);
  config.set_eeprom_timeout(30'000);
  config.set_mailbox_timeout(30'000);
  config.set_state_timeout(30'000);
  Master master(master_link, config);
  {
    Server server(slaves_link, &chain);
    master.Start();
    std::vector<DriveControl> controls(12);
    int complete = 0;
    bool enabled = false;
    for (int cycle = 0; cycle < 500 && !(enabled && complete > 100); ++cycle) {
      for (size_t i = 0; i < 12; ++i) {
        const DriveState state = DecodeState(master.inputs(i).statusword);
        master.set_outputs(i, {.controlword = controls[i].Controlword(state, DriveGoal::kEnabled),
                               .target_torque = 250,
                               .max_torque = 1000});
      }
      ASSERT_TRUE(master.Send());
      const CycleResult result = master.Receive(master_link->Now() + 2 * kSecond);
      complete += result.complete ? 1 : 0;
      enabled = true;
      for (size_t i = 0; i < 12; ++i) {
        enabled = enabled &&
                  DecodeState(master.inputs(i).statusword) == DriveState::kOperationEnabled &&
                  master.inputs(i).torque == 250;
      }
      // About a cycle of time, that transitions take.
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_TRUE(enabled);
    EXPECT_GT(complete, 100);
    EXPECT_TRUE(master.Stop());
  }
  for (size_t i = 0; i < 12; ++i) EXPECT_EQ(chain.slave(i).al_state(), AlState::kInit);
}

UdpConfig Udp(uint32_t port, const std::string& address) {
  UdpConfig config;
  config.set_port(port);
  config.set_address(address);
  return config;
}
std::unique_ptr<UdpLink> Listen(uint32_t port) {
  return std::make_unique<UdpLink>(Udp(port, "127.0.0.1"), SocketLink::Side::kSlaves);
}
std::unique_ptr<UdpLink> Connect(uint32_t port, const std::string& address = "127.0.0.1") {
  return std::make_unique<UdpLink>(Udp(port, address), SocketLink::Side::kMaster);
}

TEST(UdpLink, CarriesTwelveDrives) {
  const auto slaves = Listen(0);
  const auto master = Connect(slaves->local_port());
  RunDrives(master.get(), slaves.get());
}

TEST(UdpLink, TakesFramesOfItsPeerAlone) {
  const auto slaves = Listen(0);
  const auto master = Connect(slaves->local_port());
  const auto stranger = Connect(master->local_port());
  const uint8_t hello[] = {1, 2, 3};
  ASSERT_TRUE(stranger->Send(hello));
  std::array<uint8_t, 16> frame{};
  EXPECT_EQ(master->Receive(frame, master->Now() + 20 * kMillisecond), 0U);
  EXPECT_FALSE(slaves->Send(hello));  // nobody has asked yet
  ASSERT_TRUE(master->Send(hello));
  EXPECT_EQ(slaves->Receive(frame, slaves->Now() + kSecond), 3U);
  ASSERT_TRUE(slaves->Send(hello));
  EXPECT_EQ(master->Receive(frame, master->Now() + kSecond), 3U);
}

TEST(UdpLink, SurvivesThatNobodyListens) {
  uint16_t port = 0;
  {
    const auto gone = Listen(0);
    port = gone->local_port();
  }
  MasterConfig config = MakeMasterConfig(1);
  const auto link = Connect(port);
  Master master(link.get(), config);
  EXPECT_THAT(ErrorOf([&] { master.Start(); }), HasSubstr("no frame comes back"));
}

TEST(UdpLink, NamesAddressesThatCannotBe) {
  EXPECT_THAT(ErrorOf([] { Connect(1, "robot"); }), HasSubstr("\"robot\" is no IPv4 address"));
  const auto taken = Listen(0);
  EXPECT_THAT(ErrorOf([&] { Listen(taken->local_port()); }), HasSubstr("give another port"));
}

TEST(OpenLink, TakesExactlyOneKind) {
  LinkConfig config;
  EXPECT_THAT(ErrorOf([&] { OpenLink(config, SocketLink::Side::kMaster); }),
              HasSubstr("either udp or interface"));
  config.mutable_udp();
  EXPECT_NE(OpenLink(config, SocketLink::Side::kMaster), nullptr);
  config.mutable_udp()->set_port(70000);
  EXPECT_THAT(ErrorOf([&] { OpenLink(config, SocketLink::Side::kMaster); }),
              HasSubstr("link.udp.port: is 70000; must be 1 to 65535"));
  config.mutable_udp()->clear_port();
  config.set_interface("no_such_if");
  EXPECT_THAT(ErrorOf([&] { OpenLink(config, SocketLink::Side::kMaster); }),
              HasSubstr("either udp or interface"));
  config.clear_udp();
  EXPECT_THAT(ErrorOf([&] { OpenLink(config, SocketLink::Side::kMaster); }),
              HasSubstr("no_such_if"));
}

TEST(RawLink, NamesInterfacesThatCannotBe) {
  const std::string error = ErrorOf([] { RawLink("no_such_if", RawLink::Side::kMaster); });
  EXPECT_THAT(error, ::testing::AnyOf(HasSubstr("no such interface"), HasSubstr("CAP_NET_RAW")));
  EXPECT_NE(ErrorOf([] { RawLink("a_name_longer_than_any", RawLink::Side::kMaster); }), "");
}

/// Two ends of a virtual cable, gone at the end.
class VethPair {
 public:
  explicit VethPair(const std::string& tag = "") {
    const std::string id = std::to_string(getpid() % 100000) + tag;
    a_ = "ecm" + id;
    b_ = "ecs" + id;
    created_ = Ip("link add " + a_ + " type veth peer name " + b_) &&
               Ip("link set " + a_ + " up") && Ip("link set " + b_ + " up");
    EXPECT_TRUE(!created_ || (Carries(a_) && Carries(b_))) << "no carrier after 10 s";
  }
  ~VethPair() {
    if (created_) Ip("link del " + a_);
  }
  bool created() const { return created_; }
  const std::string& a() const { return a_; }
  const std::string& b() const { return b_; }

 private:
  static bool Ip(const std::string& arguments) {
    return std::system(("ip " + arguments + " >/dev/null 2>&1").c_str()) == 0;
  }
  // The kernel finds the carrier after `up` has returned, and drops what is sent before. It does so
  // under the lock that the second `up` takes.
  static bool Carries(const std::string& name) {
    using namespace std::chrono_literals;
    const auto end = std::chrono::steady_clock::now() + 10s;
    for (std::string state; state != "up"; std::this_thread::sleep_for(2ms)) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::ifstream("/sys/class/net/" + name + "/operstate") >> state;
    }
    return Ip("link set " + name + " up");
  }
  std::string a_, b_;
  bool created_ = false;
};

TEST(RawLink, CarriesTwelveDrivesOverAVethPair) {
  VethPair pair;
  if (!pair.created()) {
    GTEST_SKIP() << "no veth pair can be made here: needs root (CAP_NET_ADMIN) and `ip`";
  }
  RawLink master(pair.a(), RawLink::Side::kMaster);
  RawLink slaves(pair.b(), RawLink::Side::kSlaves);
  RunDrives(&master, &slaves);
}

// IEEE 802: bit 1 of the first byte says that an address is locally administered; many network
// cards of masters have such ones, all virtual ones do. The slaves answer them, too.
TEST(RawLink, AnswersAMasterWithALocallyAdministeredAddress) {
  VethPair pair;
  if (!pair.created()) {
    GTEST_SKIP() << "no veth pair can be made here: needs root (CAP_NET_ADMIN) and `ip`";
  }
  RawLink slaves(pair.b(), RawLink::Side::kSlaves);
  // Protocol 0 until bind(): packet(7) takes the frames of every interface otherwise.
  const int master = socket(AF_PACKET, SOCK_RAW, 0);
  ASSERT_GE(master, 0);
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(0x88A4);
  address.sll_ifindex = static_cast<int>(if_nametoindex(pair.a().c_str()));
  ASSERT_EQ(bind(master, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  for (const uint8_t first : {uint8_t{0x02}, uint8_t{0x00}}) {
    std::array<uint8_t, 60> sent{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, first,
                                 0x12, 0x34, 0x56, 0x78, 0x9A, 0x88, 0xA4};
    sent[14] = 0x2E;  // 46 bytes of datagrams
    sent[15] = 0x10;
    ASSERT_EQ(send(master, sent.data(), sent.size(), 0), static_cast<ssize_t>(sent.size()));
    std::array<uint8_t, 1500> frame{};
    ASSERT_EQ(slaves.Receive(frame, slaves.Now() + kSecond), 46U) << int{first};
    EXPECT_EQ(frame[1], 0x10);
    ASSERT_TRUE(slaves.Send(std::span(frame).first(46)));
    // What comes back says that a slave had it: the same address with that bit set.
    std::array<uint8_t, 1500> back{};
    sockaddr_ll from{};
    do {
      socklen_t size = sizeof(from);
      ASSERT_GT(
          recvfrom(master, back.data(), back.size(), 0, reinterpret_cast<sockaddr*>(&from), &size),
          0);
    } while (from.sll_pkttype == PACKET_OUTGOING);
    EXPECT_EQ(back[6], 0x02);
    EXPECT_EQ(back[7], 0x12);
  }
  close(master);
}

// Some slaves, simulated ones above all, send frames back with the source as it was.
TEST(RawLink, TakesItsOwnFramesBackWithoutThatBitAndNobodyElses) {
  VethPair pair;
  if (!pair.created()) {
    GTEST_SKIP() << "no veth pair can be made here: needs root (CAP_NET_ADMIN) and `ip`";
  }
  RawLink master(pair.a(), RawLink::Side::kMaster);
  const int slaves = socket(AF_PACKET, SOCK_RAW, 0);
  sockaddr_ll address{};
  address.sll_family = AF_PACKET;
  address.sll_protocol = htons(0x88A4);
  address.sll_ifindex = static_cast<int>(if_nametoindex(pair.b().c_str()));
  ASSERT_EQ(bind(slaves, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  std::array<uint8_t, 46> sent{0x2C, 0x10};
  for (const int change : {0, 1, 2}) {  // none; that bit; another master's address
    sent[2] = static_cast<uint8_t>(change);
    ASSERT_TRUE(master.Send(sent));
    std::array<uint8_t, 1500> frame{};
    sockaddr_ll from{};
    ssize_t size = 0;
    do {
      socklen_t length = sizeof(from);
      size = recvfrom(slaves, frame.data(), frame.size(), 0, reinterpret_cast<sockaddr*>(&from),
                      &length);
      ASSERT_GT(size, 0);
    } while (from.sll_pkttype == PACKET_OUTGOING);
    if (change == 1) frame[6] ^= 0x02;
    if (change == 2) frame[11] ^= 0x01;
    ASSERT_EQ(send(slaves, frame.data(), static_cast<size_t>(size), 0), size);
    std::array<uint8_t, 1500> back{};
    const size_t received = master.Receive(back, master.Now() + kSecond / 5);
    EXPECT_EQ(received > 0, change != 2) << change;
    if (received > 0) {
      EXPECT_EQ(back[2], change);
    }
  }
  close(slaves);
}

// Two chains on one machine: a link that opens beside a busy one takes nothing of that one's.
TEST(RawLink, TakesFramesOfItsOwnInterfaceAlone) {
  VethPair busy("x");
  VethPair quiet("y");
  if (!busy.created() || !quiet.created()) {
    GTEST_SKIP() << "no veth pair can be made here: needs root (CAP_NET_ADMIN) and `ip`";
  }
  RawLink sender(busy.a(), RawLink::Side::kMaster);
  std::atomic<bool> stop{false};
  std::thread traffic([&] {
    const std::array<uint8_t, 46> frame{};
    while (!stop) static_cast<void>(sender.Send(frame));
  });
  for (int i = 0; i < 200; ++i) {
    RawLink slaves(quiet.b(), RawLink::Side::kSlaves);
    std::array<uint8_t, 64> frame{};
    EXPECT_EQ(slaves.Receive(frame, slaves.Now()), 0U) << "opened for the " << i << "th time";
  }
  stop = true;
  traffic.join();
}

TEST(RawLink, SaysThatAnInterfaceIsDown) {
  VethPair pair;
  if (!pair.created()) {
    GTEST_SKIP() << "no veth pair can be made here: needs root (CAP_NET_ADMIN) and `ip`";
  }
  ASSERT_EQ(std::system(("ip link set " + pair.a() + " down").c_str()), 0);
  EXPECT_THAT(ErrorOf([&] { RawLink(pair.a(), RawLink::Side::kMaster); }), HasSubstr("is down"));
}

}  // namespace
}  // namespace poise::ethercat
