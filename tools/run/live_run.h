// A run in progress, heard on its public URL.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/bus/service_filter.h"
#include "components/framework/bus/stranger_watch.h"
#include "components/framework/bus/udp_bus.h"
#include "poise/message_traits.hpp"

namespace poise {

/// True while a `poise run` goes on in this folder (it holds a lock there).
bool RunInProgress(const std::filesystem::path& dir);

/// A checked message of a run in progress; valid during the call that hands it out.
struct LiveMessage {
  std::string_view channel;
  int index = -1;  ///< in the graph's channels; -1: HEALTH_*
  const MessageType* type = nullptr;
  int64_t tick = 0;
  std::span<const uint8_t> data;
};

/// Hears everything that the recorder mirrors: each channel's messages in order of tick, once, and
/// every process's health. It sends nothing, and the run does not wait for it. Not thread-safe.
class LiveRun {
 public:
  /// `run`: folder or name (RunNamed) of a run, empty: the only one that goes on. Throws
  /// ConfigError when no run goes on there or it has no network; the message then names
  /// `log_command` ("poise log info") for its log; of several, it says how `command` ("poise top")
  /// names one. BusError.
  LiveRun(const std::string& run, std::string_view log_command, std::string_view command);

  const RunSpec& spec() const { return spec_; }
  const std::filesystem::path& dir() const { return dir_; }
  /// The graph's channels and HEALTH_* of its components and of the recorder.
  std::vector<std::string> ChannelNames() const;
  bool InProgress() const { return RunInProgress(dir_); }

  /// Waits up to `timeout_ms`, then hands out what has arrived, one batch at most.
  void Spin(int timeout_ms, const std::function<void(const LiveMessage&)>& handle);
  /// Packets that failed a check: not sent by the run's processes, not of this run, unknown
  /// channel, wrong type, size or counts, a tick that the run cannot have.
  int64_t refused() const;

 private:
  struct Lane {
    int index;
    const MessageType* type;
    PacketFilter filter;
    bool external;
  };

  /// Its type stays nullptr when the packet is refused (and counted).
  LiveMessage Identify(const BusReceiver::Packet& packet);

  std::filesystem::path dir_;
  RunSpec spec_;
  std::vector<std::string> health_channels_;
  std::map<std::string, Lane, std::less<>> lanes_;
  std::unique_ptr<ServiceFilter> health_filter_;
  std::unique_ptr<BusReceiver> receiver_;
  std::unique_ptr<StrangerWatch> strangers_;
  int64_t refused_ = 0;
};

}  // namespace poise
