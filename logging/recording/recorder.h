// The recorder's process: collects every message of a run, logs it and mirrors it.
#pragma once

#include <csignal>
#include <cstdint>
#include <string>

#include "components/framework/bus/run_socket.h"
#include "components/framework/graph.pb.h"

namespace poise::logging {

struct RecorderOptions {
  std::string log_path;     ///< run.lcm
  std::string report_path;  ///< recorder.json: counters by channel; empty: none
  std::string scenario;     ///< text for RUN_INFO
  bool mirror = true;       ///< send everything also to the run's public URL
  const volatile std::sig_atomic_t* stop = nullptr;  ///< set by a signal handler
};

struct RecorderReport {
  int64_t ticks = 0;  ///< written with the messages of all channels
  int64_t events = 0;
  int64_t missing = 0;    ///< messages that other channels' ticks show to be lacking
  int64_t requested = 0;  ///< messages that had to be asked for again
  int64_t duplicates = 0;
  int64_t refused = 0;
  int64_t mirror_errors = 0;  ///< messages that the public URL did not get
  bool complete = false;      ///< the run ended by itself and all of it is in the log
};

/// Records until COMMAND_STOP or *options.stop. The log reaches the system at least every 100 ms.
/// Throws LogError, BusError or ConfigError.
RecorderReport Record(const RunSpec& spec, const RunSocket& socket, const RecorderOptions& options);

}  // namespace poise::logging
