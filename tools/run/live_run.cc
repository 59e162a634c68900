#include "tools/run/live_run.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "components/framework/configuration/configuration.h"
#include "components/framework/file_descriptor.h"
#include "components/framework/modules.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/channel_ticks.h"
#include "tools/run/run_dir.h"
#include "tools/run/run_registry.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

constexpr int kBatch = 4096;                     // packets before the caller's turn
constexpr int64_t kMaxTick = int64_t{1} << 52;   // exact as a double, and ever so long
constexpr std::chrono::milliseconds kPause{20};  // while a run writes its first files
constexpr std::chrono::milliseconds kConnectPatience{5'000};

fs::path FindRunDir(const std::string& run, std::string_view log_command,
                    std::string_view command) {
  if (run.empty()) return OnlyRunningRun(log_command, command).dir;
  const fs::path path = RunNamed(run, command);
  std::error_code error;
  if (fs::is_regular_file(path, error)) {
    throw ConfigError(
        fmt::format("{}: is a file, not the folder of a run in progress; for a log: {} {}", run,
                    log_command, run));
  }
  const fs::path dir = fs::canonical(path, error);
  if (error || !fs::is_directory(dir)) {
    throw ConfigError(fmt::format("{}: no such run folder", run));
  }
  return dir;
}

RunSpec ReadLiveSpec(const fs::path& dir, std::string_view log_command) {
  const fs::path file = dir / kSpecFile;
  // A run that is just starting has not written its files yet, or not whole.
  const auto deadline = std::chrono::steady_clock::now() + kConnectPatience;
  while (RunInProgress(dir)) {
    const bool last_try = std::chrono::steady_clock::now() > deadline;
    RunSpec spec;
    try {
      ReadTextProto(file.string(), &spec);
      if (spec.has_run_id()) return spec;
    } catch (const ConfigError&) {
      if (last_try) throw;
    }
    if (last_try) throw ConfigError(fmt::format("{}: holds no run", file.string()));
    std::this_thread::sleep_for(kPause);
  }
  std::error_code ignored;
  throw ConfigError(
      fs::exists(file, ignored)
          ? fmt::format("{}: this run has ended; look at its log: {} {}", dir.string(), log_command,
                        dir.string())
          : fmt::format("{}: no run goes on there; start one with poise run", dir.string()));
}

}  // namespace

bool RunInProgress(const fs::path& dir) {
  const FileDescriptor fd = open(dir.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  return fd >= 0 && flock(fd, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

LiveRun::LiveRun(const std::string& run, std::string_view log_command, std::string_view command)
    : dir_(FindRunDir(run, log_command, command)), spec_(ReadLiveSpec(dir_, log_command)) {
  if (spec_.first_port() == 0) {
    throw ConfigError(
        fmt::format("{}: runs inside one process, without the network; after its end: {} {}",
                    dir_.string(), log_command, dir_.string()));
  }
  for (int i = 0; i < spec_.graph().channel_size(); ++i) {
    const Channel& channel = spec_.graph().channel(i);
    const MessageType* type = FindMessageType(channel.type());
    if (type == nullptr || type->has_strings || !type->has_header ||
        static_cast<size_t>(channel.count_size()) != type->count_names.size()) {
      throw ConfigError(
          fmt::format("{}: channel {} has no known type '{}' with its counts; is the run of "
                      "another version of Poise?{}",
                      (dir_ / kSpecFile).string(), channel.name(), channel.type(),
                      type == nullptr ? " " + ModulesSearched() : ""));
    }
    lanes_.emplace(channel.name(),
                   Lane{i, type, logging::ChannelFilter(spec_, channel), channel.external()});
  }
  for (const ComponentInstance& instance : spec_.graph().component()) {
    health_channels_.push_back(HealthChannel(instance.name()));
  }
  health_channels_.push_back(HealthChannel(kRecorderName));
  health_filter_ = std::make_unique<ServiceFilter>(spec_, std::vector<std::string>{});
  receiver_ = std::make_unique<BusReceiver>(MirrorUrl(spec_), OfRun(spec_));
  strangers_ = std::make_unique<StrangerWatch>(spec_, StrangerWatch::Ports::kMirror);
}

std::vector<std::string> LiveRun::ChannelNames() const {
  std::vector<std::string> names = health_channels_;
  for (const Channel& channel : spec_.graph().channel()) names.push_back(channel.name());
  return names;
}

LiveMessage LiveRun::Identify(const BusReceiver::Packet& packet) {
  LiveMessage message{packet.channel, -1, nullptr, 0, {packet.data, packet.size}};
  const auto lane = lanes_.find(packet.channel);
  if (lane == lanes_.end()) {
    if (!health_filter_->CheckHealth(packet)) return message;  // which counts it
    message.type = FindMessageType("health_t");
    message.tick = ReadInt64(packet.data + message.type->run_id_offset + 8);
    return message;
  }
  const PacketFilter& filter = lane->second.filter;
  const bool external = lane->second.external;
  const int64_t last_tick = external                ? INT64_MAX
                            : spec_.num_ticks() > 0 ? spec_.num_ticks() - 1
                                                    : kMaxTick;
  if (filter.Check(packet.data, packet.size, external ? INT64_MIN : 0, last_tick) !=
      PacketVerdict::kAccepted) {
    ++refused_;
    return message;
  }
  message.index = lane->second.index;
  message.type = lane->second.type;
  message.tick = filter.tick(packet.data);
  return message;
}

void LiveRun::Spin(int timeout_ms, const std::function<void(const LiveMessage&)>& handle) {
  strangers_->Look();
  pollfd fd{receiver_->fd(), POLLIN, 0};
  if (poll(&fd, 1, timeout_ms) <= 0) return;
  BusReceiver::Packet packet;
  for (int i = 0; i < kBatch && receiver_->Receive(&packet); ++i) {
    const LiveMessage message = Identify(packet);
    if (message.type != nullptr) handle(message);
  }
}

int64_t LiveRun::refused() const {
  int64_t refused = refused_ + health_filter_->refused() + receiver_->malformed();
  for (const Stranger& stranger : strangers_->strangers()) refused += stranger.packets;
  return refused;
}

}  // namespace poise
