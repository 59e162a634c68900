// Fault injection: kills and stops controller processes at random moments, and measures what
// follows.
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "components/framework/graph.pb.h"
#include "components/framework/packet_filter.h"
#include "components/framework/udp_bus.h"
#include "deploy/poise/component_process.h"
#include "deploy/poise/run_outcome.h"

namespace poise {

/// Spreads a number of faults over a run: one in each of as many equal slots, at a random moment of
/// its first half, in a random process that can be replaced; half of them SIGKILL, half SIGSTOP for
/// 100 ms. Control is regained with the first BRIDGE_STATUS that follows a command of its own
/// cycle, when the commands of the next 20 cycles do, too.
class KillSchedule {
 public:
  /// Throws ConfigError when the graph has no bridge_status_t or nothing to restart, or when the
  /// run is too short for `count` faults.
  static void Check(const RunSpec& spec, int count);
  /// Throws BusError or, as Check, ConfigError.
  KillSchedule(const RunSpec& spec, int count, uint64_t seed);

  /// To be called often, `elapsed`: ns since the start of the run. Acts when it is time.
  void Act(int64_t now, int64_t elapsed,
           const std::vector<std::unique_ptr<ComponentProcess>>& processes);
  /// BRIDGE_STATUS's socket, and what has arrived there.
  int fd() const { return receiver_.fd(); }
  void Receive();

  const std::vector<InjectedFault>& faults() const { return faults_; }
  /// Continues all that is stopped.
  void Finish();

 private:
  void Judge(int64_t arrival, int32_t command_age);

  double slot_;  // ns
  int count_;
  std::mt19937_64 random_;
  PacketFilter filter_;
  std::string channel_;
  BusReceiver receiver_;
  std::vector<InjectedFault> faults_;
  int64_t next_ = 0;  // ns since the start
  ComponentProcess* stopped_ = nullptr;
  int64_t continue_at_ = 0;  // ns
  int64_t fault_at_ = 0;     // ns; 0: no fault is being measured
  int64_t regained_at_ = 0;  // ns; 0: not yet
  int fresh_in_a_row_ = 0;
};

}  // namespace poise
