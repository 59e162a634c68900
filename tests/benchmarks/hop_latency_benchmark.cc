// Time from a sensor message on the bus to the command that answers it: the control components as
// processes at 500 Hz, and the same hops, sizes, readers and scheduling with liblcm alone, in turn.
// Times are the kernel's, of the datagrams' arrival at one listener: neither side is asked.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <random>
#include <string>
#include <system_error>
#include <vector>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/clock.h"
#include "components/framework/configuration.h"
#include "components/framework/graph.pb.h"
#include "components/framework/run.h"
#include "components/framework/runners/timing.h"
#include "fmt/format.h"
#include "poise/message_traits.hpp"
#include "tools/cli/child_process.h"

namespace poise {
namespace {

constexpr int64_t kSecond = 1'000'000'000;  // ns
constexpr int64_t kPeriod = kSecond / 500;  // ns
constexpr const char* kHops[] = {"ROBOT_SENSORS", "ROBOT_STATE",    "SUPPORT_PLAN",
                                 "TASK_TORQUE",   "BALANCE_TORQUE", "JOINT_COMMAND"};
constexpr int kNumHops = 6;

/// Hears the datagrams of one channel with the time at which the kernel got them.
class Ear {
 public:
  explicit Ear(const std::string& group, int port)
      : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const int on = 1;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    ip_mreq membership{};
    inet_pton(AF_INET, group.c_str(), &membership.imr_multiaddr);
    const bool good =
        fd_ >= 0 && setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
        setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) == 0 &&
        bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0 &&
        setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0;
    if (!good) throw std::system_error(errno, std::generic_category(), "listening");
  }
  ~Ear() { close(fd_); }
  Ear(const Ear&) = delete;
  Ear& operator=(const Ear&) = delete;
  int fd() const { return fd_; }

  /// Arrival times, ns, of all that waits, by tick; `tick_offset` within the LCM message.
  void Hear(size_t tick_offset, std::map<int64_t, int64_t>* arrivals) {
    while (true) {
      std::array<uint8_t, 65536> data;
      std::array<char, 256> control;
      iovec part{data.data(), data.size()};
      msghdr header{};
      header.msg_iov = &part;
      header.msg_iovlen = 1;
      header.msg_control = control.data();
      header.msg_controllen = control.size();
      const ssize_t size = recvmsg(fd_, &header, MSG_DONTWAIT);
      if (size < 0) return;
      BusReceiver::Packet packet;
      if (!ParseDatagram(data.data(), static_cast<size_t>(size), &packet)) continue;
      if (packet.size < tick_offset + 8) continue;
      for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
        if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
        timespec time;
        std::memcpy(&time, CMSG_DATA(c), sizeof time);
        arrivals->emplace(ReadInt64(packet.data + tick_offset),
                          int64_t{time.tv_sec} * kSecond + time.tv_nsec);
      }
    }
  }

 private:
  int fd_;
};

/// What is measured of one side, us.
struct Latencies {
  std::vector<double> us;
  double Quantile(double q) const {
    if (us.empty()) return 0;
    std::vector<double> sorted = us;
    std::sort(sorted.begin(), sorted.end());
    const double rank = std::ceil(q * static_cast<double>(sorted.size())) - 1;
    return sorted[static_cast<size_t>(std::max(0.0, rank))];
  }
};

/// Listens for `seconds` and adds what lies between the first and the last hop of each tick.
void Listen(const std::string& group, int first_port, int last_port, size_t first_offset,
            size_t last_offset, double seconds, Latencies* latencies) {
  Ear first(group, first_port);
  Ear last(group, last_port);
  std::map<int64_t, int64_t> sent, answered;
  const int64_t end = NowNanoseconds() + static_cast<int64_t>(seconds * 1e9);
  while (NowNanoseconds() < end) {
    std::array<pollfd, 2> fds = {{{first.fd(), POLLIN, 0}, {last.fd(), POLLIN, 0}}};
    poll(fds.data(), fds.size(), 10);
    first.Hear(first_offset, &sent);
    last.Hear(last_offset, &answered);
  }
  for (const auto& [tick, time] : answered) {
    const auto start = sent.find(tick);
    if (start != sent.end()) {
      latencies->us.push_back(static_cast<double>(time - start->second) * 1e-3);
    }
  }
}

/// A ring of processes over liblcm: each answers the channel before its own.
class BareRing {
 public:
  /// `sizes` of the six messages; `readers[i]`: channels that process i reads beside the one it
  /// answers.
  BareRing(const RunSpec& spec, int first_port, const std::vector<size_t>& sizes)
      : spec_(spec), first_port_(first_port), sizes_(sizes) {
    for (int i = 0; i < kNumHops; ++i) {
      const pid_t parent = getpid();
      const pid_t pid = fork();
      if (pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) _exit(1);
        prctl(PR_SET_TIMERSLACK, 1000);
        AskForRealtime(spec_.realtime_options(), i == 0 ? Timing::kOwner : Timing::kFollower,
                       i == 0 ? 0 : kNumHops - i);
        if (i == 0) Source();
        Answer(i);
      }
      pids_.push_back(pid);
    }
  }
  ~BareRing() {
    for (const pid_t pid : pids_) kill(pid, SIGKILL);
    for (const pid_t pid : pids_) waitpid(pid, nullptr, 0);
  }
  BareRing(const BareRing&) = delete;
  BareRing& operator=(const BareRing&) = delete;

 private:
  std::string Url(int hop) const {
    return fmt::format("udpm://{}:{}?ttl=0", spec_.multicast_group(), first_port_ + hop);
  }
  /// Every period a message, and the answer is waited for as the bridge does.
  [[noreturn]] void Source() {
    lcm::LCM out(Url(0)), in(Url(kNumHops - 1));
    if (!out.good() || !in.good()) _exit(1);
    struct Handler {
      void Handle(const lcm::ReceiveBuffer*, const std::string&) {}
    } handler;
    in.subscribe(kHops[kNumHops - 1], &Handler::Handle, &handler)->setQueueCapacity(0);
    std::vector<uint8_t> data(sizes_[0]);
    int64_t next = NowNanoseconds();
    for (int64_t tick = 0;; ++tick) {
      const timespec deadline{next / kSecond, next % kSecond};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
      Stamp(tick, &data);
      out.publish(kHops[0], data.data(), static_cast<unsigned>(data.size()));
      in.handleTimeout(1);
      next += kPeriod;
    }
  }
  /// Publishes its own message for each one of the hop before. Like the components, the later ones
  /// read the state and the support plan as well.
  [[noreturn]] void Answer(int hop) {
    lcm::LCM in(Url(hop - 1)), out(Url(hop));
    std::vector<std::unique_ptr<lcm::LCM>> others;
    struct Handler {
      void Handle(const lcm::ReceiveBuffer* buffer, const std::string&) {
        if (out == nullptr) return;
        std::memcpy(data.data(), buffer->data, 8);
        out->publish(kHops[hop], data.data(), static_cast<unsigned>(data.size()));
      }
      lcm::LCM* out = nullptr;
      int hop = 0;
      std::vector<uint8_t> data;
    };
    Handler handler{&out, hop, std::vector<uint8_t>(sizes_[static_cast<size_t>(hop)])};
    Handler ignore{};
    in.subscribe(kHops[hop - 1], &Handler::Handle, &handler)->setQueueCapacity(0);
    for (int other = 1; other < std::min(hop - 1, 3); ++other) {
      others.push_back(std::make_unique<lcm::LCM>(Url(other)));
      others.back()->subscribe(kHops[other], &Handler::Handle, &ignore)->setQueueCapacity(0);
    }
    std::vector<pollfd> fds = {{in.getFileno(), POLLIN, 0}};
    for (const auto& other : others) fds.push_back({other->getFileno(), POLLIN, 0});
    while (true) {
      poll(fds.data(), fds.size(), -1);
      if (fds[0].revents != 0) in.handle();
      for (size_t i = 0; i < others.size(); ++i) {
        if (fds[i + 1].revents != 0) others[i]->handle();
      }
    }
  }
  /// The tick in the first eight bytes, big-endian as on the bus.
  static void Stamp(int64_t tick, std::vector<uint8_t>* data) {
    for (int i = 0; i < 8; ++i) {
      (*data)[static_cast<size_t>(i)] = static_cast<uint8_t>(tick >> (56 - 8 * i));
    }
  }

  const RunSpec& spec_;
  int first_port_;
  std::vector<size_t> sizes_;
  std::vector<pid_t> pids_;
};

int ChannelIndex(const RunSpec& spec, const std::string& name) {
  for (int i = 0; i < spec.graph().channel_size(); ++i) {
    if (spec.graph().channel(i).name() == name) return i;
  }
  throw ConfigError(fmt::format("the run has no channel {}", name));
}

const MessageType& TypeOfChannel(const RunSpec& spec, int channel) {
  return *FindMessageType(spec.graph().channel(channel).type());
}

int Run(const std::string& program, double seconds, int rounds) {
  namespace fs = std::filesystem;
  Latencies ours, bare;
  const fs::path folder = fs::temp_directory_path() / fmt::format("poise_hops_{}", getpid());
  for (int round = 0; round < rounds; ++round) {
    fmt::print(stderr, "round {} of {}: {:.0f} s each\n", round + 1, rounds, seconds);
    fs::remove_all(folder);
    RunSpec spec;
    {
      ChildProcess run("poise",
                       {program, "run", "push_double_support", "--set", "sim.push=", "--realtime",
                        "--no-log", "--no-reference", "--quiet", "--duration",
                        fmt::format("{}", seconds + 3), "--out", folder.string()},
                       folder.string() + ".txt");
      const fs::path file = folder / "run_spec.pbtxt";
      usleep(2'000'000);  // until it runs
      if (run.ended() || !fs::exists(file)) {
        for (const std::string& line : LastLines(run.log_path(), 5))
          fmt::print(stderr, "{}\n", line);
        return 1;
      }
      ReadTextProto(file.string(), &spec);
      const int first = ChannelIndex(spec, kHops[0]),
                last = ChannelIndex(spec, kHops[kNumHops - 1]);
      const auto offset = [&](int channel) {
        return static_cast<size_t>(TypeOfChannel(spec, channel).run_id_offset) + 8;
      };
      Listen(spec.multicast_group(), spec.first_port() + 2 + first, spec.first_port() + 2 + last,
             offset(first), offset(last), seconds, &ours);
      while (!run.ended()) usleep(10'000);
    }
    std::vector<size_t> sizes;
    for (const char* hop : kHops) {
      const int channel = ChannelIndex(spec, hop);
      const auto& counts = spec.graph().channel(channel).count();
      sizes.push_back(static_cast<size_t>(
          TypeOfChannel(spec, channel)
              .encoded_size(std::vector<int32_t>(counts.begin(), counts.end()))));
    }
    // The run's own ports are free again.
    BareRing ring(spec, spec.first_port(), sizes);
    usleep(500'000);
    Listen(spec.multicast_group(), spec.first_port(), spec.first_port() + kNumHops - 1, 0, 0,
           seconds, &bare);
  }
  fs::remove_all(folder);
  fs::remove(folder.string() + ".txt");
  fmt::print("ROBOT_SENSORS to JOINT_COMMAND, five hops, 500 Hz, us\n");
  fmt::print("{:<22}{:>9}{:>9}{:>9}{:>9}{:>9}\n", "", "ticks", "median", "p99", "p99.9", "worst");
  const auto row = [](const char* name, const Latencies& l) {
    fmt::print("{:<22}{:>9}{:>9.1f}{:>9.1f}{:>9.1f}{:>9.1f}\n", name, l.us.size(), l.Quantile(0.5),
               l.Quantile(0.99), l.Quantile(0.999), l.Quantile(1));
  };
  row("Poise, with control", ours);
  row("liblcm alone", bare);
  if (ours.us.empty() || bare.us.empty()) return 1;
  fmt::print("{:<22}{:>9}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}\n", "ratio", "",
             ours.Quantile(0.5) / bare.Quantile(0.5), ours.Quantile(0.99) / bare.Quantile(0.99),
             ours.Quantile(0.999) / bare.Quantile(0.999), ours.Quantile(1) / bare.Quantile(1));
  return 0;
}

}  // namespace
}  // namespace poise

int main(int argc, char** argv) {
  CLI::App app{"Latency of the control graph beside liblcm alone.", "hop_latency_benchmark"};
  std::string poise = (std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() /
                       "bin" / "poise")
                          .string();
  double seconds = 10;
  int rounds = 3;
  app.add_option("--poise", poise, "the program")->capture_default_str();
  app.add_option("--seconds", seconds, "of each side in each round")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 3600.0));
  app.add_option("--rounds", rounds, "in turn")->capture_default_str()->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  try {
    return poise::Run(poise, seconds, rounds);
  } catch (const std::exception& error) {
    fmt::print(stderr, "hop_latency_benchmark: {}\n", error.what());
    return 1;
  }
}
