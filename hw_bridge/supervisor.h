// Supervisor: the last gate before the motors. Whatever arrives or fails to arrive, the currents
// that leave are finite, within limits, and zero for good once the bridge has stopped.
#pragma once

#include <cstdint>
#include <vector>

#include "components/robot/robot_model.h"
#include "hw_bridge/command_gate.h"
#include "poise/bridge_status_t.hpp"
#include "poise/drive_command_t.hpp"
#include "poise/drive_feedback_t.hpp"

namespace poise {

struct SupervisorConfig {
  std::vector<robot::MotorModel> motors;  ///< by joint
  std::vector<double> torque_limit;       ///< N·m, by joint, > 0; the peak current limits too
  std::vector<double> velocity_limit;     ///< rad/s, by joint; empty: counts are not checked
  /// From one cycle to the next no joint moves further than this many times velocity_limit ×
  /// period: a fall or an impact may exceed the limit itself for a while; five times it is a broken
  /// encoder.
  double velocity_margin = 5;
  /// Cycles in which a drive may still report itself disabled after it has been told to enable.
  int enable_cycles = 2;
  int num_feet = 2;
  double period = 0.002;  ///< s, of a cycle
  int damping_after_cycles =
      3;                        ///< age of the last accepted command beyond which joints are damped
  int stop_after_cycles = 13;   ///< cycles of damping before the bridge stops
  double damping = 20;          ///< N·m·s/rad at the joint
  double stop_ramp = 0.1;       ///< s
  double velocity_cutoff = 60;  ///< Hz
};

/// States of bridge_status_t:
///   INIT      no command accepted yet: motors free
///   RUNNING   follows the last accepted command, (54), limited
///   DAMPING   the last accepted command is too old: −damping × joint velocity; an accepted command
///   leads back STOPPING  latched: damping ramped out over stop_ramp, then motors free ESTOP the
///   same, by the operator; also reached from STOPPING
/// A joint whose drive reports a fault is freed at once. Each cycle: Read, then Cycle. Never
/// allocates after construction, never throws.
class Supervisor {
 public:
  explicit Supervisor(const SupervisorConfig& config);

  /// The run whose commands are accepted.
  void SetRun(int64_t run_id) { gate_.set_run(run_id); }

  /// Takes the feedback of this cycle. False, and the bridge stops (latched), when it is not
  /// finite, beyond all reason (a joint's jump included) or wrongly sized. A drive's fault, or its
  /// staying disabled although it is told to be enabled, stops the bridge too. A cycle
  /// without feedback simply has no Read: its damping torque is zero, as no velocity is known.
  bool Read(const drive_feedback_t& feedback);

  /// Operator's stop, latched.
  void EmergencyStop() { Latch(bridge_status_t::STATE_ESTOP, bridge_status_t::REASON_OPERATOR); }

  /// Ends cycle number `cycle` (increasing, ≥ 0). `command`: what arrived in it, nullptr when
  /// nothing did. Fills currents and enables of `drives` and everything but run, tick and time of
  /// `status`; both sized for the robot.
  void Cycle(int64_t cycle, const joint_command_t* command, drive_command_t* drives,
             bridge_status_t* status);

  int8_t state() const { return state_; }
  int8_t reason() const { return reason_; }
  /// rad/s, filtered, from the encoder counts.
  const std::vector<double>& joint_velocity() const { return velocity_; }

 private:
  bool latched() const { return state_ >= bridge_status_t::STATE_STOPPING; }
  bool Usable(const drive_feedback_t& feedback) const;
  bool PlausibleCounts(const drive_feedback_t& feedback) const;
  void UpdateVelocity(const drive_feedback_t& feedback);
  void Latch(int8_t state, int8_t reason);
  void UpdateState(int64_t cycle, const joint_command_t* command);
  double DampingTorque(size_t joint, double share) const;

  SupervisorConfig config_;
  CommandGate gate_;
  double velocity_gain_;  // of the first-order low-pass, per cycle
  int64_t stop_ramp_cycles_;
  std::vector<double> torque_;  // N·m, last accepted command
  std::vector<int64_t> counts_;
  std::vector<double> velocity_;
  std::vector<char> faulted_;
  std::vector<char> enabled_;         // as last commanded
  std::vector<int> disabled_cycles_;  // reported disabled while enabled, in a row
  bool counts_known_ = false;         // counts_ are those of the cycle before
  bool feedback_read_ = false;        // in this cycle
  int8_t state_ = bridge_status_t::STATE_INIT;
  int8_t reason_ = bridge_status_t::REASON_NO_COMMAND;
  int8_t last_refusal_ = bridge_status_t::REASON_NO_COMMAND;  // since the last accepted command
  int64_t ramp_left_ = 0;
  int64_t saturations_ = 0;
};

}  // namespace poise
