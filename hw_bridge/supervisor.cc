#include "hw_bridge/supervisor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hw_bridge/units.h"

namespace poise {
namespace {

// No sensor of a robot reports more, in A, rad/s, m/s², N or N·m: products of readings stay finite.
constexpr double kImplausible = 1e9;

bool Plausible(double value) { return std::abs(value) <= kImplausible; }  // false for NaN

template <class Range>
bool AllPlausible(const Range& values) {
  return std::all_of(std::begin(values), std::end(values), Plausible);
}

int8_t ReasonOf(Refusal refusal) {
  switch (refusal) {
    case Refusal::kRun:
      return bridge_status_t::REASON_COMMAND_RUN;
    case Refusal::kSize:
      return bridge_status_t::REASON_COMMAND_SIZE;
    case Refusal::kSequence:
      return bridge_status_t::REASON_COMMAND_SEQUENCE;
    case Refusal::kStale:
      return bridge_status_t::REASON_COMMAND_STALE;
    case Refusal::kNotFinite:
      return bridge_status_t::REASON_COMMAND_NOT_FINITE;
    case Refusal::kNone:
      break;
  }
  return bridge_status_t::REASON_NONE;
}

}  // namespace

Supervisor::Supervisor(const SupervisorConfig& config)
    : config_(config),
      gate_(static_cast<int>(config.motors.size()), config.damping_after_cycles),
      velocity_gain_(1 - std::exp(-2 * std::numbers::pi * config.velocity_cutoff * config.period)),
      stop_ramp_cycles_(std::llround(std::ceil(config.stop_ramp / config.period - 1e-9))),
      torque_(config.motors.size(), 0.0),
      counts_(config.motors.size(), 0),
      velocity_(config.motors.size(), 0.0),
      faulted_(config.motors.size(), 0),
      enabled_(config.motors.size(), 0),
      disabled_cycles_(config.motors.size(), 0) {
  for (size_t j = 0; j < config.motors.size(); ++j) {
    const robot::MotorModel& motor = config.motors[j];
    config_.torque_limit[j] =
        std::min(config.torque_limit[j], JointTorque(motor, motor.peak_current));
  }
}

bool Supervisor::Usable(const drive_feedback_t& feedback) const {
  const size_t n = config_.motors.size();
  if (feedback.position_counts.size() != n || feedback.current.size() != n ||
      feedback.drive_status.size() != n ||
      feedback.foot_wrench.size() != static_cast<size_t>(config_.num_feet)) {
    return false;
  }
  return PlausibleCounts(feedback) && AllPlausible(feedback.current) &&
         AllPlausible(feedback.imu_angular_velocity) && AllPlausible(feedback.imu_acceleration) &&
         std::all_of(feedback.foot_wrench.begin(), feedback.foot_wrench.end(),
                     [](const wrench_t& wrench) {
                       return AllPlausible(wrench.force) && AllPlausible(wrench.moment);
                     });
}

// Across a cycle without feedback nothing is known of the way.
bool Supervisor::PlausibleCounts(const drive_feedback_t& feedback) const {
  if (!counts_known_ || config_.velocity_limit.empty()) return true;
  for (size_t j = 0; j < counts_.size(); ++j) {
    const double change =
        static_cast<double>(feedback.position_counts[j]) - static_cast<double>(counts_[j]);
    const double most = config_.velocity_margin * config_.velocity_limit[j] * config_.period;
    if (std::abs(change) / CountsPerRadian(config_.motors[j]) > most) return false;
  }
  return true;
}

bool Supervisor::Read(const drive_feedback_t& feedback) {
  if (!Usable(feedback)) {
    // Of the reasons the nearest: readings that are finite but cannot be are as little to be used.
    Latch(bridge_status_t::STATE_STOPPING, bridge_status_t::REASON_FEEDBACK_NOT_FINITE);
    return false;
  }
  UpdateVelocity(feedback);
  for (size_t j = 0; j < faulted_.size(); ++j) {
    const int32_t status = feedback.drive_status[j];
    if (status != drive_feedback_t::DRIVE_DISABLED && status != drive_feedback_t::DRIVE_ENABLED) {
      faulted_[j] = 1;
      Latch(bridge_status_t::STATE_STOPPING, bridge_status_t::REASON_DRIVE_FAULT);
    }
    const bool refuses = enabled_[j] != 0 && status == drive_feedback_t::DRIVE_DISABLED;
    disabled_cycles_[j] =
        refuses ? std::min(disabled_cycles_[j] + 1, config_.enable_cycles + 1) : 0;
    if (disabled_cycles_[j] > config_.enable_cycles) {
      faulted_[j] = 1;
      Latch(bridge_status_t::STATE_STOPPING, bridge_status_t::REASON_DRIVE_FAULT);
    }
  }
  return true;
}

void Supervisor::UpdateVelocity(const drive_feedback_t& feedback) {
  for (size_t j = 0; j < velocity_.size(); ++j) {
    const int64_t counts = feedback.position_counts[j];
    if (counts_known_) {
      // As doubles: the difference of two 64-bit counts may not fit 64 bits.
      const double change = static_cast<double>(counts) - static_cast<double>(counts_[j]);
      const double raw = change / CountsPerRadian(config_.motors[j]) / config_.period;
      velocity_[j] += velocity_gain_ * (raw - velocity_[j]);
    }
    counts_[j] = counts;
  }
  counts_known_ = true;
  feedback_read_ = true;
}

void Supervisor::Latch(int8_t state, int8_t reason) {
  if (latched()) {
    if (state == bridge_status_t::STATE_ESTOP) state_ = state;
    return;
  }
  // Motors that were never enabled are not enabled in order to stop.
  ramp_left_ = state_ == bridge_status_t::STATE_INIT ? 0 : stop_ramp_cycles_;
  state_ = state;
  reason_ = reason;
}

void Supervisor::UpdateState(int64_t cycle, const joint_command_t* command) {
  if (command != nullptr) {
    const Refusal refusal = gate_.Check(*command, cycle);
    if (refusal != Refusal::kNone) {
      last_refusal_ = ReasonOf(refusal);
    } else if (!latched()) {
      std::copy(command->torque.begin(), command->torque.end(), torque_.begin());
      state_ = bridge_status_t::STATE_RUNNING;
      reason_ = bridge_status_t::REASON_NONE;
      last_refusal_ = bridge_status_t::REASON_NO_COMMAND;
    }
  }
  if (latched()) return;
  if (state_ == bridge_status_t::STATE_INIT) {
    reason_ = last_refusal_;
    return;
  }
  const int64_t age = gate_.Age(cycle);
  if (age <= config_.damping_after_cycles) return;
  if (age <= int64_t{config_.damping_after_cycles} + config_.stop_after_cycles) {
    state_ = bridge_status_t::STATE_DAMPING;
    reason_ = last_refusal_;
  } else {
    Latch(bridge_status_t::STATE_STOPPING, last_refusal_);
  }
}

double Supervisor::DampingTorque(size_t joint, double share) const {
  return feedback_read_ ? -share * config_.damping * velocity_[joint] : 0.0;
}

void Supervisor::Cycle(int64_t cycle, const joint_command_t* command, drive_command_t* drives,
                       bridge_status_t* status) {
  UpdateState(cycle, command);

  const bool running = state_ == bridge_status_t::STATE_RUNNING;
  const bool enabled = running || state_ == bridge_status_t::STATE_DAMPING || ramp_left_ > 0;
  const double share =
      ramp_left_ > 0 ? static_cast<double>(ramp_left_) / static_cast<double>(stop_ramp_cycles_)
                     : 1.0;
  for (size_t j = 0; j < torque_.size(); ++j) {
    const robot::MotorModel& motor = config_.motors[j];
    const bool follow = enabled && faulted_[j] == 0;
    double torque = 0;
    bool saturated = false;
    if (follow) {
      const double wanted = running ? torque_[j] : DampingTorque(j, share);
      const double limit = config_.torque_limit[j];
      torque = std::clamp(wanted, -limit, limit);
      saturated = running && torque != wanted;
    }
    const double current =
        std::clamp(MotorCurrent(motor, torque), -motor.peak_current, motor.peak_current);
    drives->current[j] = current;
    drives->enabled[j] = follow ? 1 : 0;
    enabled_[j] = follow ? 1 : 0;
    status->applied_torque[j] = torque;
    status->saturated[j] = saturated ? 1 : 0;
    saturations_ += saturated ? 1 : 0;
  }
  if (ramp_left_ > 0) --ramp_left_;
  counts_known_ = counts_known_ && feedback_read_;
  feedback_read_ = false;

  status->state = state_;
  status->reason = reason_;
  status->command_age = gate_.any_accepted()
                            ? static_cast<int32_t>(std::min<int64_t>(
                                  gate_.Age(cycle), std::numeric_limits<int32_t>::max()))
                            : 0;
  status->refused_not_finite = gate_.refused(Refusal::kNotFinite);
  status->refused_stale = gate_.refused(Refusal::kStale);
  status->refused_sequence = gate_.refused(Refusal::kSequence);
  status->refused_size = gate_.refused(Refusal::kSize);
  status->refused_run = gate_.refused(Refusal::kRun);
  status->saturations = saturations_;
}

}  // namespace poise
