// Distributed clocks: one time for all slaves of a line, SYNC0, and the cycle that follows it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hw_bridge/ethercat/slave_access.h"

namespace poise::ethercat {

/// What a slave latched as one broadcast write passed it, ns of its own clock.
struct DcTimes {
  uint32_t port0 = 0;  ///< on its way out
  uint32_t port1 = 0;  ///< on its way back from the slaves behind
  bool last = false;   ///< no slave behind
  int64_t unit = 0;    ///< at the processing unit
};

/// Delay, ns, from the first slave to each, of slaves in a line: half of the difference between
/// neighbours' round trips, since both ways take the same time.
std::vector<int32_t> PropagationDelays(std::span<const DcTimes> times);

/// Writes delays and offsets so that all slaves show the first one's time, which starts at
/// `epoch`. Slaves in chain order. Throws EthercatError: a slave without 64-bit clock.
void SetUpClocks(Transactions* transactions, std::span<SlaveAccess> slaves, int64_t epoch);

/// Starts SYNC0 of all slaves at `shift` ns (modulo `cycle`) of the common time.
void StartSync0(std::span<SlaveAccess> slaves, uint32_t cycle, int32_t shift);

/// A difference to the common time, ns, from register 0x092C.
constexpr int32_t DcDifference(uint32_t value) {
  const auto magnitude = static_cast<int32_t>(value & 0x7FFFFFFF);
  return (value & 0x80000000) != 0 ? -magnitude : magnitude;
}

/// Keeps the master's cycle at a fixed phase of the reference clock: a proportional-integral
/// controller, whose integral takes up the difference between the two oscillators.
class CycleSteering {
 public:
  /// `cycle`: ns.
  explicit CycleSteering(int64_t cycle) : cycle_(cycle) {}

  /// `system_time`: of the reference clock as this cycle's frame passed it. Returns ns by which the
  /// next cycle must start later (negative: earlier) than one period after this one; at most 1 % of
  /// the period.
  int64_t Update(int64_t system_time);
  /// ns that the last frame passed too late (positive) or too early.
  int64_t phase_error() const { return phase_error_; }

 private:
  int64_t cycle_;
  int64_t phase_error_ = 0;
  double integral_ = 0;
};

}  // namespace poise::ethercat
