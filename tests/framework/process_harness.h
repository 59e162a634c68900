// Starts a toy graph as processes, supervises it as a launcher does and collects all its messages.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "components/framework/bus/run_socket.h"
#include "components/framework/graph.pb.h"
#include "poise/health_t.hpp"

namespace poise {

/// [channel][tick] -> bytes; in real time empty where a tick was skipped.
using Messages = std::vector<std::vector<std::vector<uint8_t>>>;

/// The same run inside this process.
Messages RunInline(const RunSpec& spec);

struct ProcessRun {
  Messages messages;
  std::map<std::string, health_t> health;  ///< last seen, by component
  std::map<std::string, int>
      exit_codes;  ///< by process; minus the signal for a process that one ended
  int64_t final_tick = -1;
  int64_t missing = -1;
  bool timed_out = false;
};

struct HarnessOptions {
  const RunSocket* socket = nullptr;  ///< of the run; nullptr: one is opened
  bool reverse = false;               ///< start the processes in reverse order
  int late_after_ms = 0;  ///< start the last process this long after the first COMMAND_START
  bool collect = true;    ///< a recorder takes part
  int max_seconds = 60;   ///< a run that takes longer is ended and marked
  std::function<void()> while_running = nullptr;  ///< called every few milliseconds once all run
  /// Called every few milliseconds once all run, with the pids and what has been recorded.
  std::function<void(const std::map<std::string, pid_t>&, const Messages&)> disturb = nullptr;
  /// Ends the run early, with SIGTERM to all; called with the pids once all run.
  std::function<bool(const std::map<std::string, pid_t>&)> end = nullptr;
};

/// All processes of `run` gone with exit code 0, nothing missing, every byte as inline.
void ExpectEqualToInline(const RunSpec& spec, const ProcessRun& run, int64_t ticks);

/// Adds a component's own configuration.
void Configure(RunSpec* spec, const std::string& name, const std::string& text);

/// Fills in what processes must know of the graph, runs `spec` and waits until all processes have
/// gone.
ProcessRun RunAsProcesses(RunSpec spec, const HarnessOptions& options = {});

/// Runs a program and returns its exit code and what it wrote to stderr.
std::pair<int, std::string> RunProgram(const std::vector<std::string>& arguments);

}  // namespace poise
