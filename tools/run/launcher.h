// Runs a graph as processes: starts, watches and ends them.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "components/framework/bus/control_client.h"
#include "components/framework/graph.pb.h"
#include "tools/cli/child_process.h"
#include "tools/cli/progress.h"
#include "tools/cli/stall_watch.h"
#include "tools/report/machine_load.h"
#include "tools/report/run_outcome.h"
#include "tools/run/component_process.h"
#include "tools/run/crane_watch.h"
#include "tools/run/kill_schedule.h"

namespace poise {

/// What else a run of processes may ask for.
struct LaunchOptions {
  bool log = true;    ///< false: no recorder takes part
  KillOptions kills;  ///< faults to inject, see KillSchedule; in real time only
};

/// One run. Leaves no process behind, whatever happens.
class Launcher {
 public:
  /// `dir`: the run's folder, which holds its files (WriteRunFiles) and gets run.lcm, recorder.json
  /// and each process's output. `socket` and `progress` outlive the launcher. Throws BusError, or
  /// ConfigError for faults that cannot be injected.
  Launcher(const RunSpec& spec, const RunSocket& socket, std::filesystem::path dir,
           const LaunchOptions& options, Progress* progress);
  ~Launcher();

  /// Starts everything, waits until it is ready, runs, and ends everything. Throws
  /// std::system_error when a process cannot be made.
  RunOutcome Run();

 private:
  void StartProcesses();
  bool WaitUntilReady();
  /// All components, and the processes that stand by for them.
  bool Ready() const;
  bool Start();
  void Watch();
  void StopProcesses();

  /// Notes the end of the run when a process died or a signal came. True when the run goes on.
  bool Healthy();
  /// Notes the end of the run when the recorder says that it cannot go on.
  bool RecorderFailed();
  /// The first failure counts. `message`: what is wrong, with times and files.
  void Fail(RunFault fault, std::string message, std::vector<std::string> details = {});
  void Fail(std::string message);  ///< without times and files, and nobody's
  /// Components whose silence the others wait for; all at the lowest tick where none is silent.
  std::vector<std::string> WaitedFor(int64_t now) const;
  void FailProcess(ComponentProcess& process);
  int64_t Tick() const;  ///< last tick that any component has completed

  RunSpec spec_;
  const RunSocket& socket_;
  const std::filesystem::path dir_;
  Progress* progress_;
  ControlClient control_;
  void MeasureMemory(int64_t now, int64_t start);
  void ReportProcesses();
  /// Waits for health, the end of a process or what the kill schedule listens to.
  void Wait(int timeout_ms);
  /// A process that can be replaced and has been silent for long, though the machine let it run, is
  /// ended, so that it is.
  void EndSilent(int64_t now);

  std::unique_ptr<KillSchedule> kills_;
  std::unique_ptr<CraneWatch> crane_;
  MachineLoadSampler machine_;
  bool log_;
  std::vector<std::unique_ptr<ComponentProcess>> processes_;  // the recorder's is the first, if any
  std::map<const ComponentProcess*, SilenceWatch> silence_;   // of those that can be replaced
  int64_t next_measure_ = 0;                                  // ns, of memory
  RunOutcome outcome_;
};

}  // namespace poise
