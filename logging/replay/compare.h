// Bitwise comparison of two runs' logs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace poise::logging {

struct LogDifference {
  int64_t tick = 0;
  std::string channel;
  std::string field;  ///< "torque[3]"; empty when only one of the runs has the message
  std::string first;  ///< value in the first run, all digits; "absent" without the message
  std::string second;
};

struct LogComparison {
  int64_t ticks = 0;      ///< that both logs hold
  int64_t messages = 0;   ///< that both logs hold
  int64_t differing = 0;  ///< of these, with other bits
  int64_t only_first = 0;
  int64_t only_second = 0;
  std::optional<LogDifference> earliest;  ///< of the lowest tick, there in the graph's order
  bool equal() const { return differing == 0 && only_first == 0 && only_second == 0; }
};

/// Compares every message of every channel of the graph, bit for bit apart from run_id. RUN_INFO,
/// health and external channels do not count. Throws LogError: a log cannot be read, or the graphs'
/// channels differ.
LogComparison CompareLogs(const std::string& first, const std::string& second);

}  // namespace poise::logging
