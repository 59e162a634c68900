// Collects every message of a run, in order and without loss: the recorder's ear.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/bus/stranger_watch.h"
#include "components/framework/graph.pb.h"

namespace poise {

/// Receives all channels of a run, asks for what is missing and reports its progress to the tick
/// sources. Also answers for its own process on HEALTH_<name> and follows START and STOP. Not
/// thread-safe.
class ChannelCollector {
 public:
  struct Callbacks {
    /// A channel's message: strictly once per tick and in tick order per channel, in real time
    /// without the ticks that its writer has skipped; external channels as they come.
    std::function<void(int channel, int64_t tick, std::span<const uint8_t> data)> message;
    /// A message of the service port (CONTROL, or HEALTH_* of the process it names), well formed
    /// and of this run.
    std::function<void(std::string_view channel, std::span<const uint8_t> data)> service = nullptr;
    /// Real time: of this channel no message before `tick` will come any more. May be empty.
    std::function<void(int channel, int64_t tick)> skipped = nullptr;
  };

  /// `spec` must hold the channels' counts (FillPlan); `socket` must outlive this. Throws BusError;
  /// ConfigError when counts are missing.
  ChannelCollector(const RunSpec& spec, const RunSocket& socket, const std::string& name,
                   Callbacks callbacks);
  ~ChannelCollector();

  /// Receives for up to `timeout_ms`, delivers, requests and reports. Returns after the first
  /// batch.
  void Spin(int timeout_ms);

  /// Says on HEALTH_<name>, until COMMAND_STOP or for a second, that it cannot go on, and why: its
  /// own output may be what cannot be written.
  void Fail(std::string_view reason);

  /// Last tick of which every (not external) channel has been delivered; -1 at first.
  int64_t recorded_tick() const;
  /// Earliest final tick that a component reported with its end; -1 while the run goes on.
  int64_t final_tick() const;
  /// True once the run has ended and everything up to final_tick() has been delivered.
  bool complete() const;
  /// True after COMMAND_STOP.
  bool stopped() const;

  struct ChannelStatistics {
    int64_t delivered = 0;
    int64_t requested = 0;  ///< ticks that had to be asked for again
    int64_t duplicates = 0;
    int64_t refused = 0;    ///< failed a check of PacketFilter
    int64_t skipped = 0;    ///< real time: ticks that nobody has sent
    int64_t next_tick = 0;  ///< first tick neither delivered nor skipped
  };
  const ChannelStatistics& statistics(int channel) const;
  /// What others have sent to the run, and nobody has taken. HEALTH_<name> tells of it too.
  const std::vector<Stranger>& strangers() const;
  /// Messages of ticks <= `last_tick` that were not delivered, over all channels, skipped ones
  /// included: 0 in a run without loss.
  int64_t missing(int64_t last_tick) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace poise
