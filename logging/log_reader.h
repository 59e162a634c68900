// Reads LCM event logs, damaged ones too.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "logging/run_log_writer.h"

namespace poise::logging {

struct LogEvent {
  int64_t number = 0;
  int64_t utime = 0;  ///< us
  std::string_view channel;
  std::span<const uint8_t> data;
};

/// Events in the order of the file. Lengths are checked against the file before they are used; what
/// is no record is skipped up to the next one and counted.
class LogReader {
 public:
  /// Throws LogError.
  explicit LogReader(const std::string& path);
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  /// False at the end. The event's channel and data live as long as the reader.
  bool Next(LogEvent* event);
  /// Places where the file held no record, and the bytes skipped there. A log cut short counts as
  /// damaged at its end.
  int64_t damages() const { return damages_; }
  int64_t skipped_bytes() const { return skipped_; }

 private:
  bool ParseAt(size_t position, LogEvent* event, size_t* end) const;

  const uint8_t* data_ = nullptr;
  size_t size_ = 0;
  size_t position_ = 0;
  int64_t damages_ = 0;
  int64_t skipped_ = 0;
};

}  // namespace poise::logging
