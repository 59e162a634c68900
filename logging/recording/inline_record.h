// The record of a graph that runs inside this process, without a log.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "logging/run_record.h"

namespace poise::logging {

/// Taps an InlineRunner and keeps its messages. Take gives what ReadRun gives of the log that
/// InlineRecorder writes of the same run, but no latencies: they are of the machine, not of the
/// run. Both must outlive the last Step of the runner.
class InlineRecord {
 public:
  /// Installs itself as the runner's tap. Throws RobotError.
  InlineRecord(const RunSpec& spec, const std::string& scenario, InlineRunner* runner);

  /// Ends the record.
  RunRecord Take();

 private:
  using Keep = std::function<void(int64_t tick, const void* message)>;

  InlineRunner* runner_;
  RunRecord run_;
  std::vector<Keep> keep_;         // by channel; empty: no series of its type
  std::vector<int64_t> messages_;  // by channel
};

}  // namespace poise::logging
