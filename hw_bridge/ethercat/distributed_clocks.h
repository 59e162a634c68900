// Distributed clocks: one time for all slaves, SYNC0, and the cycle that follows it.
#pragma once

#include <cstdint>
#include <span>

#include "hw_bridge/ethercat/slave_access.h"

namespace poise::ethercat {

/// Makes every slave keep when this one broadcast passes its ports. Throws EthercatError: no frame
/// came back.
void LatchClocks(Transactions* transactions);

/// Writes delays (ns, by slave) and offsets so that all slaves show the first one's time, which
/// starts at `epoch`; their clocks' control loops begin anew. `slaves` have clocks.
void SetUpClocks(Transactions* transactions, std::span<SlaveAccess* const> slaves,
                 std::span<const int32_t> delays, int64_t epoch);

/// Makes one slave's clock that of `reference`, whose time goes on and whom a frame reaches `delay`
/// ns earlier.
void JoinClock(Transactions* transactions, SlaveAccess* reference, SlaveAccess* slave,
               int32_t delay);

/// Starts a slave's SYNC0 half a `cycle` (ns) after each cycle of the common time begins: a late
/// frame is before its SYNC0 still.
void StartSync0(SlaveAccess* slave, uint32_t cycle);

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
