// Writes a run as a standard LCM event log, in an order that does not depend on how it ran.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/graph.pb.h"
#include "logging/event_log_writer.h"
#include "poise/run_info_t.hpp"

namespace poise::logging {

inline constexpr char kRunInfoChannel[] = "RUN_INFO";

/// RUN_INFO first; then tick by tick the message of every channel in the graph's order; messages of
/// the services port and of external channels where they came. Event times are the messages' own
/// utime, us of the run; of external channels, whose senders know no tick, the time of the first
/// tick that is not complete. Two runs of the same scenario differ in run_id, RUN_INFO and HEALTH_*
/// only.
class RunLogWriter {
 public:
  /// `spec` must hold the channels' counts. Throws LogError.
  RunLogWriter(const std::string& path, const RunSpec& spec, const run_info_t& info);

  /// The encoded message of `tick` on channel `channel` of the graph. Every channel's ticks must
  /// come in order and without a gap but for skipped ones (std::logic_error otherwise); channels
  /// may run ahead of each other. External channels: any tick. Throws LogError.
  void AddMessage(int channel, int64_t tick, std::span<const uint8_t> data);
  /// Real time: of this channel no message before `tick` will come any more. Throws LogError.
  void Skip(int channel, int64_t tick);
  /// A HEALTH_* message. Throws LogError.
  void AddHealth(std::string_view channel, std::span<const uint8_t> data);
  /// Hands what is written to the system. Throws LogError.
  void Flush() { log_.Flush(); }
  /// Writes also the ticks that some channel lacks, and closes. Throws LogError.
  void Close();

  int64_t events() const { return log_.events(); }
  /// Ticks written with the messages of all channels, but for skipped ones.
  int64_t complete_ticks() const { return next_tick_; }
  /// After Close: messages that were missing from the last, incomplete ticks.
  int64_t missing() const { return missing_; }

 private:
  struct Lane {
    std::string name;
    bool external = false;
    size_t size = 0;             // bytes a message
    int utime_offset = 0;        // in the encoded message
    int64_t next_tick = 0;       // first tick that has not come
    std::vector<uint8_t> bytes;  // ticks [next_tick_, next_tick), by tick modulo capacity_
    std::vector<char> present;   // likewise; 0: skipped
  };
  void WriteCompleteTicks();
  void Grow();
  int64_t TimeUnderWay() const;  // us
  void WriteTick(int64_t tick);

  EventLogWriter log_;
  std::vector<Lane> lanes_;
  int64_t capacity_ = 16;  // ticks a lane can hold
  int64_t next_tick_ = 0;  // first tick not written
  int64_t missing_ = 0;
  double tick_period_;  // s
  int64_t num_ticks_;   // of the run; 0: open
  int health_utime_offset_ = 0;
};

/// This moment as RUN_INFO.started_at has it, ISO 8601 in UTC.
std::string TimeNow();

/// RUN_INFO of a run that starts now: the texts that a replay needs. `scenario` is the scenario's
/// text.
run_info_t MakeRunInfo(const RunSpec& spec, const std::string& scenario);

}  // namespace poise::logging
