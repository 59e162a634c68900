// How a run ended.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "poise/health_t.hpp"
#include "tools/report/machine_load.h"

namespace poise {

/// A fault that the launcher caused on purpose.
struct InjectedFault {
  std::string process;
  bool killed = false;   ///< SIGKILL; else SIGSTOP for 100 ms
  double time = 0;       ///< s of wall time, in the scenario's time
  double regained = -1;  ///< s until control was regained; 0: no command was late; -1: not in time
  int32_t cycles = 0;    ///< longest age of a command meanwhile
};

/// What a component of a run says of itself at the end, and the memory of its process: of several
/// in one, with the first.
struct ProcessReport {
  health_t health;
  int64_t resident_first = 0;  ///< bytes, 10 s after the start; 0: the run was shorter
  int64_t resident_last = 0;   ///< bytes
};

/// Why a run ended before its plan, in words that are the same whenever it ends so again: without
/// times of this machine and files.
struct RunFault {
  enum class Kind { kStopped, kCrashed, kHung };
  Kind kind = Kind::kStopped;
  std::string component;  ///< empty: none alone is to blame
  std::string what;
};

struct RunOutcome {
  bool completed = false;    ///< the planned end was reached, or a component ended the run well
  bool ticks_done = false;   ///< all ticks until that end are computed and in the log
  bool interrupted = false;  ///< by a signal
  std::string message;       ///< why the run ended; empty after the planned end
  RunFault fault;            ///< what the message says, for comparison
  std::string warning;       ///< of what changed nothing about the run; empty: nothing
  std::vector<std::string> details;  ///< last lines of the output of the process at fault
  int64_t refused = 0;               ///< packets that the launcher refused on the service port
  /// What others have sent to the run, and nobody has taken; empty: nothing.
  std::string strangers;
  std::vector<std::string> warnings;  ///< of its processes, "hw_bridge: ..."
  std::vector<InjectedFault> faults;
  std::vector<ProcessReport>
      processes;                       ///< by component, in the graph's order; none of a run inline
  int32_t takeovers = 0;               ///< processes that took the place of one that died
  std::optional<MachineLoad> machine;  ///< in real time
  std::optional<double> crane_let_go;  ///< s of the scenario's time; empty: no crane, or not yet
  double wall_time = 0;                ///< s, from the start command to the last tick
};

}  // namespace poise
