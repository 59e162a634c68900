// A part of a run's log as a log of its own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"

namespace poise::logging {

struct CutRange {
  int64_t first_tick = 0;
  int64_t last_tick = INT64_MAX;
  std::vector<std::string> channels;  ///< none: all
};

struct CutResult {
  int64_t events = 0;      ///< written, RUN_INFO included
  int64_t first_tick = 0;  ///< that the cut log is to hold
  int64_t last_tick = 0;
  int64_t refused =
      0;  ///< events in the range (by their event times) that could not be read, left out
};

/// Ticks of the scenario's times [from, to] s, both included.
CutRange TicksOfTimes(double from, double to, const RunSpec& spec);

/// Copies the messages of the range's ticks and channels, of RUN_INFO all, with the cut noted in
/// its run_spec: whoever reads the log knows what it is to hold. Messages that came without a tick
/// of their own (external channels) are taken by their event times. What came before the log's
/// first tick or after its last goes with that tick: HEALTH_* of a component that starts. Throws
/// LogError: `from` is no run's log, a channel is not in it, the range holds no tick, `to` exists
/// or cannot be written.
CutResult CutLog(const std::string& from, const CutRange& range, const std::string& to);

}  // namespace poise::logging
