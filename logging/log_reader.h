// Reads LCM event logs, damaged ones too.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/message_fields.h"
#include "logging/paged_file.h"
#include "logging/run_log_writer.h"

namespace poise::logging {

struct LogEvent {
  int64_t number = 0;
  int64_t utime = 0;  ///< us
  std::string_view channel;
  std::span<const uint8_t> data;
  uint64_t offset = 0;  ///< of the record in the file, bytes
};

/// The type whose fingerprint the event's data begin with; nullptr: they begin with none's.
const MessageType* TypeByFingerprint(const LogEvent& event);
/// TypeByFingerprint, where the data are one message of it, with a header and whole; else nullptr.
const MessageType* WholeMessageType(const LogEvent& event);

/// A place where the file held no record.
struct LogDamage {
  uint64_t offset = 0;                  ///< bytes
  uint64_t size = 0;                    ///< bytes skipped
  int64_t number_before = -1;           ///< of the event before it; -1: none
  std::optional<int64_t> number_after;  ///< of the event after it; empty: the file ends there
  /// Events that the numbers around it show to be lost; empty when they do not tell.
  std::optional<int64_t> lost_events() const;
};

/// True when the file begins as an event log does.
bool IsEventLog(const std::string& path);

/// Events in the order of the file, of which the part last read takes memory. Lengths are checked
/// against the file before they are used; what is no record is skipped up to the next one and
/// counted.
class LogReader {
 public:
  /// Throws LogError.
  explicit LogReader(const std::string& path);

  /// False at the end. The event's channel and data live as long as the reader.
  bool Next(LogEvent* event);
  /// Back to the beginning.
  void Rewind();
  /// Places where the file held no record, and the bytes skipped there. A log cut short counts as
  /// damaged at its end.
  int64_t damages() const { return static_cast<int64_t>(damage_.size()); }
  int64_t skipped_bytes() const;
  const std::vector<LogDamage>& damage() const { return damage_; }
  uint64_t file_size() const { return size_; }
  /// Whether the file is no longer what it was when the reader was made.
  bool file_changed() const { return file_.changed(); }
  /// The file's bytes, which events' data are a part of; nullptr for an empty file.
  const uint8_t* bytes() const { return data_; }

 private:
  bool ParseAt(size_t position, LogEvent* event, size_t* end) const;
  void LetGo();

  PagedFile file_;
  const uint8_t* data_;
  size_t size_;
  size_t position_ = 0;
  size_t released_ = 0;  // pages before it were let go
  int64_t number_ = -1;  // of the last event
  std::vector<LogDamage> damage_;
};

}  // namespace poise::logging
