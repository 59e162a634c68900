// Fault injection: kills and stops controller processes at random moments, and measures what
// follows.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "components/framework/graph.pb.h"
#include "poise/bridge_status_t.hpp"
#include "tools/report/run_outcome.h"
#include "tools/run/channel_tap.h"
#include "tools/run/component_process.h"

namespace poise {

/// The faults of a run.
struct KillOptions {
  int count = 0;  ///< 0: none
  uint64_t seed = 1;
  /// s of the scenario's time between which they fall; negative: while the robot starts.
  double from = 0;
  std::optional<double> until;  ///< default: the end
};

/// Spreads a number of faults over a time: one in each of as many equal slots, at a random moment
/// of its first half, in a random process that can be replaced; half of them SIGKILL, half SIGSTOP
/// for 100 ms. Control is regained with the first BRIDGE_STATUS that follows a command of its own
/// cycle, when the commands of the next 20 cycles do, too.
class KillSchedule {
 public:
  /// Throws ConfigError when the graph has no bridge_status_t or nothing to restart, or when the
  /// time is too short for so many.
  static void Check(const RunSpec& spec, const KillOptions& options);
  /// Throws BusError or, as Check, ConfigError.
  KillSchedule(const RunSpec& spec, const KillOptions& options);

  /// To be called often, `elapsed`: ns since the start of the run. Acts when it is time.
  void Act(int64_t now, int64_t elapsed,
           const std::vector<std::unique_ptr<ComponentProcess>>& processes);
  /// BRIDGE_STATUS's socket, and what has arrived there.
  int fd() const { return status_.fd(); }
  void Receive();

  const std::vector<InjectedFault>& faults() const { return faults_; }
  /// Continues all that is stopped.
  void Finish();

 private:
  void Judge(int64_t arrival, const bridge_status_t& status);
  /// ns since the start, of a fault at a share of its slot.
  int64_t TimeOf(int fault, double share) const;

  double first_ = 0, slot_ = 0;  // ns since the start, of the first slot; of a slot
  double lead_ = 0;              // s
  int count_;
  std::mt19937_64 random_;
  ChannelTap<bridge_status_t> status_;
  std::vector<InjectedFault> faults_;
  int64_t next_ = 0;  // ns since the start
  ComponentProcess* stopped_ = nullptr;
  int64_t continue_at_ = 0;  // ns
  int64_t fault_at_ = 0;     // ns; 0: no fault is being measured
  int64_t regained_at_ = 0;  // ns; 0: not yet
  int fresh_in_a_row_ = 0;
  bool lost_ = false;  // a command was late since the fault
};

}  // namespace poise
