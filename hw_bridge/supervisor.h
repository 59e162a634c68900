// Supervisor: the last gate before the motors. Whatever arrives or fails to arrive, the currents
// that leave are finite, within limits, and zero once the bridge has stopped.
#pragma once

#include <bitset>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hw_bridge/command_gate.h"
#include "hw_bridge/drive/drive_bus.h"
#include "hw_bridge/feedback_monitor.h"
#include "hw_bridge/impedance.h"
#include "hw_bridge/supervisor_config.h"
#include "hw_bridge/thermal_budget.h"
#include "hw_bridge/tilt_filter.h"
#include "poise/bridge_status_t.hpp"
#include "poise/drive_command_t.hpp"
#include "poise/drive_feedback_t.hpp"

namespace poise {

/// States of bridge_status_t:
///   INIT      no command accepted yet: motors free; with hold_before_command only until the
///             motors may start
///   ENABLING  told to enable, without torque, until all drives report it
///   RUNNING   follows the last accepted command, (54), limited
///   HOLDING   the last accepted command is too old: its torque, and stiffness and damping about
///             the position where it was lost; an accepted command leads back. Before the first
///             command: no torque but these two, about the position at the start
///   DAMPING   the same, −damping × joint velocity
///   STOPPING  latched: damping ramped out over 0.1 s
///   STOPPED   latched: motors free
///   ESTOP     both, by operator, STO or signal
/// Limits hold for the drive's whole torque as of the last reading: stiffness and damping deviate
/// from it only with the joint.
/// A joint whose drive reports a fault is freed at once. Each cycle: Read, then Cycle. Never
/// allocates after construction, never throws.
class Supervisor {
 public:
  explicit Supervisor(const SupervisorConfig& config);

  /// The run whose commands are accepted.
  void SetRun(int64_t run_id) { gate_.set_run(run_id); }

  /// Takes the feedback of this cycle. False, and the bridge stops (latched), when it is not
  /// to be used: not finite, beyond all reason, wrongly sized, or an encoder that is broken. A
  /// drive's fault or STO, its being disabled while the bridge runs, and trips of position,
  /// velocity and tilt stop the bridge too. A cycle without feedback simply has no Read: damping
  /// has no torque then, as no velocity is known. `reports`: by joint, or empty.
  bool Read(const drive_feedback_t& feedback, std::span<const DriveReport> reports = {});
  /// Stops when the bus is no longer usable, and shows how it has been.
  void ReadBus(const BusHealth& health);
  /// s that this cycle began after its time; counts overruns and stops after too many.
  void CountLateness(double lateness);

  /// Stops and stays so, for an operator or a signal (REASON_*).
  void EmergencyStop(int8_t reason = bridge_status_t::REASON_OPERATOR) {
    Latch(bridge_status_t::STATE_ESTOP, reason);
  }
  /// The planned end: ramps out and stays.
  void Shutdown() { Latch(bridge_status_t::STATE_STOPPING, bridge_status_t::REASON_SHUTDOWN); }
  /// Ends a latched stop in this cycle, if its ramp is over and its command asks for no torque.
  /// Then INIT. True in the cycle in which that happened: see TakeReset.
  void RequestReset() { reset_requested_ = true; }
  /// Whether the last Cycle has reset the stop; the drives' faults are to be reset then.
  bool TakeReset() { return std::exchange(reset_, false); }

  /// Ends cycle number `cycle` (increasing, ≥ 0). `command`: what arrived in it, nullptr when
  /// nothing did. Fills currents and enables of `drives` and everything but run, tick and time of
  /// `status`; both sized for the robot.
  void Cycle(int64_t cycle, const joint_command_t* command, drive_command_t* drives,
             bridge_status_t* status);

  int8_t state() const { return state_; }
  int8_t reason() const { return reason_; }
  bool at_rest() const { return latched() && ramp_left_ == 0; }
  /// rad/s, filtered, from the encoder counts.
  const std::vector<double>& joint_velocity() const { return monitor_.velocity(); }
  /// rad/s, likewise unfiltered: over the last two cycles that followed each other.
  const std::vector<double>& raw_joint_velocity() const { return monitor_.raw_velocity(); }
  /// N·m that the drive of a joint gave at the last reading, as it was last commanded.
  double OrderedTorque(size_t joint, const drive_command_t& command) const;

 private:
  bool latched() const { return state_ >= bridge_status_t::STATE_STOPPING; }
  bool active() const {
    return state_ >= bridge_status_t::STATE_ENABLING && state_ <= bridge_status_t::STATE_DAMPING;
  }
  void Enter(int8_t state, int8_t reason, int joint = -1);
  /// Enters a state of a stop, which only a reset leaves.
  void Latch(int8_t state, int8_t reason, int joint = -1);
  void CheckDrives(const drive_feedback_t& feedback, std::span<const DriveReport> reports);
  void CheckMotion(const drive_feedback_t& feedback);
  bool MayStart();
  void Reset(const joint_command_t* command);
  void UpdateState(int64_t cycle, const joint_command_t* command);
  /// Holds the joints where they are, or goes on with it.
  void Hold();
  void UpdateLoss(int64_t age);
  /// The first command is waited for with the joints held.
  bool AwaitsFirst() const {
    return config_.settings.hold_before_command() && !gate_.any_accepted();
  }
  void Follow(int64_t age);
  double Position(size_t joint) const;
  /// Whether the joint is within its limits and their margin.
  bool Inside(size_t joint) const;
  double DampingTorque(size_t joint, double share) const;
  double WantedTorque(size_t joint) const;
  /// What the drive is to close by itself in this state; adds LIMIT_IMPEDANCE to `limits`.
  Impedance WantedImpedance(size_t joint, int8_t* limits) const;
  Impedance FollowedImpedance(size_t joint, int8_t* limits) const;
  /// Share of the command's stiffness and damping while it is faded in.
  double FadeIn() const;
  /// Limits what the drive of a joint gives and sets its command.
  void Command(size_t joint, bool powered, drive_command_t* drives, int8_t* limits);
  /// The torque within all limits; adds to `limits` those that have changed it.
  double Limit(size_t joint, double wanted, int8_t* limits) const;
  double FadePosition(size_t joint, double torque) const;
  double FadeVelocity(size_t joint, double torque) const;
  /// rad/s that no controlled motion has.
  double TripSpeed(size_t joint) const {
    return config_.settings.velocity_trip() * config_.velocity_limit[joint];
  }
  void FillStatus(int64_t cycle, bridge_status_t* status) const;

  SupervisorConfig config_;
  CommandGate gate_;
  FeedbackMonitor monitor_;
  TiltFilter tilt_;
  std::vector<ThermalBudget> thermal_;
  double speed_gain_;  // of mean_speed_, per cycle
  int stop_ramp_cycles_, first_ramp_cycles_, resume_cycles_;
  int hold_cycles_;                      // between the last command's end and damping
  std::vector<double> torque_;           // N·m, last accepted command
  std::vector<Impedance> impedance_;     // of the same command
  std::vector<double> current_;          // A, that the drives give as of the last reading
  std::vector<double> applied_;          // N·m, of the cycle before
  std::vector<double> hold_torque_;      // N·m
  std::vector<int64_t> hold_counts_;     // where joints are held
  std::vector<double> resume_from_;      // N·m, applied before the command was back
  std::vector<char> faulted_, enabled_;  // enabled_: as reported
  std::vector<double> mean_speed_;       // rad/s, without sign, over kSpeedTime
  std::vector<int8_t> drive_state_;
  int8_t state_ = bridge_status_t::STATE_INIT;
  int8_t reason_ = bridge_status_t::REASON_NO_COMMAND;
  int reason_joint_ = -1;
  int8_t last_refusal_ = bridge_status_t::REASON_NO_COMMAND;  // since the last accepted command
  int64_t ramp_left_ = 0;                                     // cycles of the stop
  int enabling_cycles_ = 0;                                   // so far
  int start_ramp_ = 0;   // cycles since RUNNING began, up to first_ramp_cycles_
  int resume_left_ = 0;  // cycles of fading in
  int fault_grace_ = 0;  // cycles in which a reset may still be under way
  bool reset_requested_ = false, reset_ = false;
  bool slew_known_ = false;  // applied_ is of a followed command
  BusHealth bus_;
  double lateness_ = 0;
  int64_t cycles_ = 0, overruns_ = 0;
  int overruns_in_a_row_ = 0;
  std::bitset<100> late_;  // by cycle, modulo 100
  int64_t saturations_ = 0, resets_ = 0;
};

}  // namespace poise
