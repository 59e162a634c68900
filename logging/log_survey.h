// What a log holds, and what is wrong with it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"
#include "logging/channel_ticks.h"
#include "logging/log_reader.h"
#include "poise/health_t.hpp"
#include "poise/run_info_t.hpp"

namespace poise::logging {

struct ChannelSurvey {
  std::string type;  ///< empty: not known
  bool external = false;
  /// Names as the log has them, any bytes: ForTerminal.
  ChannelCompleteness ticks;         ///< external channels and others: name, messages, refused
  std::vector<TickRange> missing;    ///< ticks
  std::vector<uint64_t> refused_at;  ///< bytes, offsets of the refused messages' records
  int64_t bytes = 0;                 ///< of the messages' data
};

/// A message that stands next to a damage.
struct Neighbour {
  std::string channel;
  std::optional<int64_t> tick;
};

struct DamageSurvey {
  LogDamage damage;
  std::optional<Neighbour> before;
  std::optional<Neighbour> after;  ///< empty: the file ends there
};

struct LogSurvey {
  /// Why the run cannot be told; then there is no info, and channels are told by their events
  /// alone.
  std::string info_problem;
  std::string info_warning;  ///< RunInfo::warning
  run_info_t info;
  RunSpec spec;
  uint64_t file_size = 0;  ///< bytes
  int64_t events = 0;
  int64_t first_tick = 0;                  ///< that the log is to hold: 0, or where it was cut
  int64_t end_tick = 0;                    ///< last tick of any channel + 1
  std::vector<ChannelSurvey> channels;     ///< of the graph, in its order; cut ones left out
  std::vector<ChannelSurvey> others;       ///< by name: RUN_INFO, HEALTH_*, strangers
  std::map<std::string, health_t> health;  ///< by component: its last
  std::vector<DamageSurvey> damage;

  double duration(int64_t ticks) const { return static_cast<double>(ticks) * spec.tick_period(); }
  /// Lines that say what is wrong, fit for a terminal; none: the log is whole. `limit`: places
  /// named at most of each kind, 0: all.
  std::vector<std::string> Problems(size_t limit) const;
};

/// Reads all of a log. Throws LogError when the file cannot be read.
LogSurvey SurveyLog(const std::string& path);

}  // namespace poise::logging
