// DriveBus: the drives of a robot, simulated or real, one control cycle at a time.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "poise/bridge_status_t.hpp"
#include "poise/bus_status_t.hpp"
#include "poise/drive_command_t.hpp"
#include "poise/drive_feedback_t.hpp"

namespace poise {

/// How a bus has been of late. A bus without frames of its own leaves it as it is.
struct BusHealth {
  bool usable = true;      ///< false until a reset: too many bad cycles in a row or of the last 100
  bool link_lost = false;  ///< of an unusable bus: nothing came back, rather than too little
  int bad_in_a_row = 0;    ///< cycles without usable inputs
  int bad_in_100 = 0;      ///< of the last 100
  int64_t cycles = 0, bad_cycles = 0;
  uint8_t al_status = 0;  ///< of all slaves, or-ed; 0x08: all in OP
  int64_t frames_sent = 0, frames_lost = 0, working_counter_errors = 0;  ///< since the first cycle
  int64_t refused_currents = 0;  ///< that were not finite, sent as zero
  /// REASON_* that the robot stops for by itself, or that its remote asks for (an emergency stop).
  int8_t stop = bridge_status_t::REASON_NONE;
};

/// State, DRIVE_* of bridge_status_t, of a drive that reports no more than drive_feedback's.
constexpr int8_t DriveStateOf(int32_t drive_status) {
  switch (drive_status) {
    case drive_feedback_t::DRIVE_DISABLED:
      return bridge_status_t::DRIVE_SWITCH_ON_DISABLED;
    case drive_feedback_t::DRIVE_ENABLED:
      return bridge_status_t::DRIVE_ENABLED;
    case drive_feedback_t::DRIVE_FAULT:
      return bridge_status_t::DRIVE_FAULT;
    default:
      return bridge_status_t::DRIVE_UNKNOWN;
  }
}

/// What a drive says of itself beside its feedback.
struct DriveReport {
  int8_t state = bridge_status_t::DRIVE_UNKNOWN;  ///< DRIVE_*, CiA 402
  bool sto = false;                               ///< its safe torque off is active
  int8_t stop = bridge_status_t::REASON_NONE;  ///< REASON_*: it asks for a stop, with this reason
};

/// What a bus reads by itself, in its feedback, beside the drives' positions and currents.
struct SensorsOfBus {
  bool imu = false, feet = false;
  bool velocity = false;  ///< of the joints, as the drives measure it
};

/// Start, Idle until the first cycle, Receive and Send once a cycle, Idle after the last, Stop.
/// Idle, Receive and Send never allocate or throw; they wait no longer than the bus's configuration
/// says.
class DriveBus {
 public:
  virtual ~DriveBus() = default;

  /// Brings the drives to where they take commands, without torque. Blocks. Throws
  /// std::runtime_error with what to do.
  virtual void Start() {}
  /// Takes all torque and brings the drives to rest. Blocks for a second or two. Empty: done; else
  /// what went wrong.
  virtual std::string Stop() { return {}; }
  /// An exchange without torque that keeps the drives' watchdogs content. `enable`: drives may come
  /// up meanwhile.
  virtual void Idle(bool enable) { static_cast<void>(enable); }
  /// Lets the rest of a cycle pass, for cycles that no runner paces.
  virtual void AwaitNextCycle() {}

  /// What the drives report in this cycle (sensors that are no drives are left out by a bus that
  /// has none); nullptr when not all of it arrived. Valid until the next call.
  virtual const drive_feedback_t* Receive() = 0;
  /// Sends currents and enables for this cycle (sizes as in the feedback), and stiffness and
  /// damping where the drives close them.
  virtual void Send(const drive_command_t& command) = 0;
  /// Whether the drives add stiffness and damping to the current's torque. Else both are sent as 0.
  virtual bool impedance() const { return false; }

  virtual SensorsOfBus sensors() const { return {}; }
  /// By joint, as last received; empty: the feedback's drive_status is all there is.
  virtual std::span<const DriveReport> reports() const { return {}; }
  virtual const BusHealth& health() const = 0;
  /// Resets faults of all drives, which are commanded disabled, by one edge, and forgets bad
  /// cycles.
  virtual void RequestFaultReset() {}
  /// Slaves of the bus whose state Diagnose writes; 0: a bus without any.
  virtual int num_slaves() const { return 0; }
  /// What each slave shows of itself. Precondition: `status` is sized for num_slaves().
  virtual void Diagnose(bus_status_t* status) const { static_cast<void>(status); }
  /// ns by which the next cycle should start later (negative: earlier) than a period after this
  /// one.
  virtual int64_t cycle_correction() const { return 0; }
};

}  // namespace poise
