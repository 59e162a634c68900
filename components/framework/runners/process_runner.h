// Runs a process of a run on the bus: one component, or several that share it.
#pragma once

#include <csignal>
#include <memory>
#include <string>

#include "components/framework/bus/run_socket.h"
#include "components/framework/graph.h"

namespace poise {

struct ProcessRunnerOptions {
  /// The run's, which must outlive the runner. nullptr: it is asked for.
  const RunSocket* socket = nullptr;
  /// Set (by a signal handler) to end the process cleanly.
  const volatile std::sig_atomic_t* stop = nullptr;
  /// Tick sources wait for the recorder (COMMAND_RECORDED). Default: RunSpec.recorded.
  bool wait_for_recorder = false;
  /// A StateStore's file: the state is kept there after each tick in real time. Empty: nowhere.
  std::string state_path;
  /// Waits, configured, until set (by a signal handler), then goes on from the stored state in
  /// place of a process that died. nullptr: starts with the others.
  const volatile std::sig_atomic_t* take_over = nullptr;
};

/// Lockstep: joins inputs by tick, runs each stage as soon as its inputs are there, sends its
/// outputs, asks again for what does not come and answers such requests. Real time: see Timing. The
/// start waits for COMMAND_START, the end for COMMAND_STOP. After the start nothing allocates,
/// throws or locks. Between its components messages pass by reference; what no other process waits
/// for is sent when nothing else is to be done.
class ProcessRunner {
 public:
  /// Configures the components of `process`, whose types `registry` has. Throws GraphError,
  /// ConfigError, BusError or std::system_error (the state's file).
  ProcessRunner(const RunSpec& spec, const std::string& process, const ComponentRegistry& registry,
                const ProcessRunnerOptions& options);
  ~ProcessRunner();

  /// Runs until COMMAND_STOP or *options.stop. Returns false when the bus failed, a component sent
  /// a number that is not finite, or its hardware did not start or stop; error() says which.
  bool Run();
  const std::string& error() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace poise
