// What the machine was busy with while a run in real time went on.
#pragma once

#include <cstdint>
#include <optional>

namespace poise {

/// How busy the machine was with all that ran on it, this run included.
struct MachineLoad {
  int cpus = 0;          ///< that are online
  double load = 0;       ///< load average of a minute, at the end; lags behind a short run
  double runnable = 0;   ///< processes that ran or waited for a CPU, mean
  int runnable_max = 0;  ///< likewise, most
  /// Share of the time in which a process somewhere waited for a CPU; not every kernel tells.
  std::optional<double> pressure;
};

/// Samples /proc/loadavg and /proc/pressure/cpu from its making on.
class MachineLoadSampler {
 public:
  /// To be called often, `now`: ns. Reads ten times a second.
  void Sample(int64_t now);
  /// The load of all samples so far.
  MachineLoad Load() const;

 private:
  int64_t next_ = 0;   // ns
  int64_t start_ = 0;  // ns, of the first reading of the pressure
  int64_t last_ = 0;
  int64_t samples_ = 0, sum_ = 0;
  int most_ = 0;
  double load_ = 0;
  std::optional<int64_t> stalled_first_, stalled_last_;  // us
};

}  // namespace poise
