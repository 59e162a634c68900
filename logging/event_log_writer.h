// Writes standard LCM event logs.
#pragma once

#include <lcm/eventlog.h>

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "logging/log_sums.h"

namespace poise::logging {

/// A log that cannot be written or read. what() is one line naming the file and the reason.
class LogError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a record of LCM's format begins with, and the bytes before its channel's name.
inline constexpr uint32_t kEventLogMagic = 0xEDA1DA01u;
inline constexpr size_t kEventLogHeader = 28;
/// Makes `record` that of an event.
void PutRecord(int64_t number, std::string_view channel, int64_t utime,
               std::span<const uint8_t> data, std::vector<uint8_t>* record);

/// One log in LCM's format; events are numbered from 0. A record is put together here: liblcm's own
/// function writes it in eight pieces.
class EventLogWriter {
 public:
  /// Replaces a file of that name, and the sums beside it. Throws LogError.
  explicit EventLogWriter(const std::string& path);
  /// `utime` in us. Throws LogError.
  void Write(std::string_view channel, int64_t utime, std::span<const uint8_t> data);
  /// Hands what is written to the system. Throws LogError.
  void Flush();
  /// With `sums`, check sums of what is written go beside the log (LogSums). Throws LogError.
  void Close(bool sums = false);
  int64_t events() const { return events_; }
  bool open() const { return log_ != nullptr; }

 private:
  struct CloseLog {
    void operator()(lcm_eventlog_t* log) const { lcm_eventlog_destroy(log); }
  };
  std::string path_;
  std::vector<uint8_t> record_;
  LogSums sums_;
  std::unique_ptr<lcm_eventlog_t, CloseLog> log_;
  int64_t events_ = 0;
};

}  // namespace poise::logging
