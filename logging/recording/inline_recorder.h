// Records a graph that runs inside this process.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "components/framework/runners/inline_runner.h"
#include "logging/recording/inline_record.h"
#include "logging/run_log_writer.h"
#include "poise/health_t.hpp"

namespace poise::logging {

/// What each component's health tells where a person has ended a run that would not end by itself.
inline constexpr char kEndedByHand[] = "ended by hand";

/// The health of a component (an index in the graph) as it stands.
health_t FinalHealth(const RunSpec& spec, const InlineRunner& runner, int component);

/// Taps an InlineRunner and writes the log that the recorder's process would write of the same run,
/// apart from health. Both must outlive the last Step of the runner.
class InlineRecorder {
 public:
  /// Installs itself as the runner's tap. `spec` must hold the channels' counts. `kept`, where
  /// there is one, gets every message too. Throws LogError.
  InlineRecorder(const std::string& path, const RunSpec& spec, const run_info_t& info,
                 InlineRunner* runner, InlineRecord* kept = nullptr);

  /// A caller that sets a tap of its own afterwards calls this in it.
  void Add(int channel, const OutputPort& output, const Tick& tick);

  void AddExternal(int channel, std::span<const uint8_t> data) {
    writer_.AddMessage(channel, -1, data);
  }

  /// Writes the components' health as it stands, and closes. `detail`: of those that tell of no end
  /// themselves. Throws LogError.
  void Close(const RunSpec& spec, const std::string& detail = "");
  const RunLogWriter& writer() const { return writer_; }
  void Flush() { writer_.Flush(); }

 private:
  RunLogWriter writer_;
  InlineRunner* runner_;
  std::vector<uint8_t> buffer_;
};

}  // namespace poise::logging
