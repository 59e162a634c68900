// A small log, message by message.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/logging/log_test_support.h"

namespace poise::logging {

/// Two data channels, PUSH before COMMAND (12 motors), and an external one, STOP.
RunSpec SmallSpec();

/// force[0] is the tick plus 0.25.
std::vector<uint8_t> Push(int64_t tick);
/// current[i] is the tick.
std::vector<uint8_t> Command(int64_t tick);
/// The last of component "robot".
std::vector<uint8_t> FinalHealth(int64_t tick);

/// RUN_INFO, PUSH and COMMAND of ticks 0 to `ticks` - 1, and the final health.
std::vector<RawEvent> SmallLog(int64_t ticks);

/// Size of an event's record in a log, bytes.
inline size_t RecordSize(const RawEvent& event) {
  return 28 + event.channel.size() + event.data.size();
}
/// Offset of event `index` in a log that holds `events`, bytes.
size_t RecordOffset(const std::vector<RawEvent>& events, size_t index);

}  // namespace poise::logging
