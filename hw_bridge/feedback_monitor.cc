#include "hw_bridge/feedback_monitor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hw_bridge/drive/units.h"
#include "poise/bridge_status_t.hpp"

namespace poise {
namespace {

// No sensor of a robot reports more, in A, rad/s, m/s², N or N·m: products of readings stay finite.
constexpr double kImplausible = 1e9;
// From one cycle to the next no joint moves further than this many times velocity_limit × period: a
// fall or an impact may exceed the limit itself for a while; five times it is a broken encoder.
constexpr double kVelocityMargin = 5;
// s: by then a torque beyond friction has moved a joint by a count, with the readings' delay and a
// rotor of 0.5 kg·m² on the coarsest encoder at the joint.
constexpr double kResponseTime = 0.02;
// s without a count from an encoder, after which it is frozen if its torque changed by more than
// frozen_torque kResponseTime ago or before.
constexpr double kFrozenTime = 0.1;
// Hz, cut-off of the low-pass on the joint velocity that damping uses. Far above it the encoder's
// steps become torque; much lower, its lag makes the damping of light ankles (0.1 kg·m²) oscillate.
constexpr double kVelocityCutoff = 60;
// Cycles in a row with torque_error after which a measured torque is implausible: a current loop
// settles in one or two.
constexpr int kTorqueErrorCycles = 10;

bool Plausible(double value) { return std::abs(value) <= kImplausible; }  // false for NaN

template <class Range>
bool AllPlausible(const Range& values) {
  return std::all_of(std::begin(values), std::end(values), Plausible);
}

}  // namespace

bool Plausible(const wrench_t& wrench) {
  return AllPlausible(wrench.force) && AllPlausible(wrench.moment);
}

FeedbackMonitor::FeedbackMonitor(const SupervisorConfig& config)
    : config_(config),
      frozen_cycles_(std::max(1, config.Cycles(kFrozenTime))),
      response_cycles_(std::max(1, config.Cycles(kResponseTime))),
      velocity_gain_(1 - std::exp(-2 * std::numbers::pi * kVelocityCutoff * config.period)),
      counts_(config.motors.size(), 0),
      velocity_(config.motors.size(), 0.0),
      raw_velocity_(config.motors.size(), 0.0),
      commanded_(static_cast<size_t>(std::max(1, config.current_cycles)),
                 std::vector<double>(config.motors.size(), 0.0)),
      watches_(config.motors.size()) {}

FeedbackMonitor::Problem FeedbackMonitor::Find(const drive_feedback_t& feedback) const {
  const size_t n = config_.motors.size();
  const Problem unusable{bridge_status_t::REASON_FEEDBACK_NOT_FINITE, -1};
  if (feedback.position_counts.size() != n || feedback.velocity.size() != n ||
      feedback.current.size() != n || feedback.drive_status.size() != n ||
      feedback.foot_wrench.size() != static_cast<size_t>(config_.num_feet) ||
      feedback.foot_sensor.size() != static_cast<size_t>(config_.num_feet)) {
    return unusable;
  }
  if (const int joint = FindJump(feedback); joint >= 0) {
    return {bridge_status_t::REASON_ENCODER_JUMP, joint};
  }
  for (size_t j = 0; j < n; ++j) {
    if (!Plausible(feedback.current[j]) || !Plausible(feedback.velocity[j])) {
      return {unusable.reason, static_cast<int>(j)};
    }
  }
  // A foot's sensor may fail: the robot stands without it (HwBridge::Sense).
  const bool rest =
      AllPlausible(feedback.imu_angular_velocity) && AllPlausible(feedback.imu_acceleration);
  return rest ? Problem{} : unusable;
}

// Across a cycle without feedback nothing is known of the way.
int FeedbackMonitor::FindJump(const drive_feedback_t& feedback) const {
  if (!consecutive_) return -1;
  for (size_t j = 0; j < counts_.size(); ++j) {
    // Doubles are subtracted: the difference of two 64-bit counts may not fit 64 bits.
    const double change =
        static_cast<double>(feedback.position_counts[j]) - static_cast<double>(counts_[j]);
    const double most = kVelocityMargin * config_.velocity_limit[j] * config_.period;
    if (std::abs(change) / CountsPerRadian(config_.motors[j]) > most) return static_cast<int>(j);
  }
  return -1;
}

FeedbackMonitor::Problem FeedbackMonitor::FindFault(const drive_feedback_t& feedback) {
  for (size_t j = 0; j < watches_.size(); ++j) {
    Watch& watch = watches_[j];
    const robot::MotorModel& motor = config_.motors[j];
    const double torque = JointTorque(motor, commanded_.front()[j]);
    if (!watch.enabled || !consecutive_ || feedback.position_counts[j] != counts_[j]) {
      watch.still_cycles = watch.changed_cycles = 0;
    } else {
      if (watch.still_cycles == 0) watch.least_torque = watch.greatest_torque = torque;
      watch.still_cycles = std::min(watch.still_cycles + 1, frozen_cycles_);
      watch.least_torque = std::min(watch.least_torque, torque);
      watch.greatest_torque = std::max(watch.greatest_torque, torque);
      const bool changed =
          watch.greatest_torque - watch.least_torque > config_.thresholds.frozen_torque;
      watch.changed_cycles = changed ? std::min(watch.changed_cycles + 1, response_cycles_) : 0;
    }
    if (watch.still_cycles >= frozen_cycles_ && watch.changed_cycles >= response_cycles_) {
      return {bridge_status_t::REASON_ENCODER_FROZEN, static_cast<int>(j)};
    }
    double least = commanded_.front()[j], greatest = least;
    for (const std::vector<double>& commanded : commanded_) {
      least = std::min(least, commanded[j]);
      greatest = std::max(greatest, commanded[j]);
    }
    const double beyond = feedback.current[j] - std::clamp(feedback.current[j], least, greatest);
    const bool differs = motor.current_sensor && watch.enabled &&
                         std::abs(JointTorque(motor, beyond)) > config_.thresholds.torque_error;
    watch.error_cycles = differs ? std::min(watch.error_cycles + 1, kTorqueErrorCycles) : 0;
    if (differs && watch.error_cycles >= kTorqueErrorCycles) {
      return {bridge_status_t::REASON_TORQUE_IMPLAUSIBLE, static_cast<int>(j)};
    }
  }
  return {};
}

FeedbackMonitor::Problem FeedbackMonitor::Update(const drive_feedback_t& feedback) {
  Problem problem = Find(feedback);
  if (problem.reason != bridge_status_t::REASON_NONE) return problem;
  problem = FindFault(feedback);
  for (size_t j = 0; j < velocity_.size(); ++j) {
    const int64_t counts = feedback.position_counts[j];
    if (consecutive_) {
      const double change = static_cast<double>(counts) - static_cast<double>(counts_[j]);
      raw_velocity_[j] = change / CountsPerRadian(config_.motors[j]) / config_.period;
      velocity_[j] += velocity_gain_ * (raw_velocity_[j] - velocity_[j]);
    }
    counts_[j] = counts;
  }
  known_ = updated_ = true;
  return problem;
}

void FeedbackMonitor::EndCycle(std::span<const double> current, std::span<const int8_t> enabled) {
  std::ranges::rotate(commanded_, commanded_.end() - 1);  // moves the vectors, not their numbers
  for (size_t j = 0; j < watches_.size(); ++j) {
    commanded_.front()[j] = current[j];
    watches_[j].enabled = enabled[j] != 0;
  }
  consecutive_ = updated_;
  updated_ = false;
}

void FeedbackMonitor::Reset() {
  for (Watch& watch : watches_) {
    watch.still_cycles = watch.changed_cycles = watch.error_cycles = 0;
  }
}

}  // namespace poise
