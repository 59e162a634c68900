// The record of a graph that runs inside this process, without a log.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "logging/run_record.h"

namespace poise::logging {

/// Keeps the messages of an InlineRunner. Take gives what ReadRun gives of the log that
/// InlineRecorder writes of the same run. Must outlive the last Step of the runner.
class InlineRecord {
 public:
  /// Installs itself as the runner's tap, and keeps nothing of RunRecord::other. Throws RobotError.
  InlineRecord(const RunSpec& spec, const std::string& scenario, InlineRunner* runner);
  /// Installs no tap: the caller has one that calls Add. Throws RobotError.
  InlineRecord(const RunSpec& spec, run_info_t info, const InlineRunner* runner);

  void Add(int channel, const OutputPort& output, const Tick& tick);

  /// Ends the record. Latencies are of the machine, not of the run: 0 unless asked for.
  RunRecord Take(bool latencies = false);

 private:
  using Keep = std::function<void(int64_t tick, const void* message)>;

  const InlineRunner* runner_;
  RunRecord run_;
  std::vector<Keep> keep_;                            // by channel; empty: no series of its type
  std::vector<Series<std::vector<uint8_t>>*> other_;  // by channel, where keep_ is empty
  std::vector<int64_t> messages_;                     // by channel
};

}  // namespace poise::logging
