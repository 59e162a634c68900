#include "hw_bridge/ethercat/emulator/emulated_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "hw_bridge/ethercat/process_image.h"

namespace poise::ethercat {
namespace {

constexpr double kNanosecondsPerMs = 1e6;
constexpr uint8_t kRw = ObjectDictionary::kWritable;
constexpr uint8_t kRx = ObjectDictionary::kWritable | ObjectDictionary::kRxMappable;
constexpr uint8_t kTx = ObjectDictionary::kTxMappable;

/// Counts of a shaft's angle, wrapping around at 32 bits as the drive's counter does.
uint32_t Counts(double angle, uint32_t counts_per_turn) {
  const double counts = std::floor(angle / (2 * std::numbers::pi) * counts_per_turn);
  return static_cast<uint32_t>(static_cast<int64_t>(std::fmod(counts, 4294967296.0)));
}

}  // namespace

EmulatedDrive::EmulatedDrive(const EmulatedDriveConfig& config, ObjectDictionary* dictionary,
                             MotorLoad* load)
    : config_(config), load_(load) {
  ObjectDictionary& objects = *dictionary;
  controlword_ = objects.Add({object::kControlword, 0}, 2, kRx);
  statusword_ = objects.Add({object::kStatusword, 0}, 2, kTx);
  mode_ = objects.Add({object::kModeOfOperation, 0}, 1, kRx);
  mode_display_ = objects.Add({object::kModeDisplay, 0}, 1, kTx);
  target_torque_ = objects.Add({object::kTargetTorque, 0}, 2, kRx);
  max_torque_ = objects.Add({object::kMaxTorque, 0}, 2, kRx);
  torque_object_ = objects.Add({object::kTorque, 0}, 2, kTx);
  position_ = objects.Add({object::kPosition, 0}, 4, kTx);
  velocity_ = objects.Add({object::kVelocity, 0}, 4, kTx);
  error_code_ = objects.Add({object::kErrorCode, 0}, 2, kTx);
  objects.Add({object::kTargetPosition, 0}, 4, kRx);
  objects.Add({object::kTargetVelocity, 0}, 4, kRx);
  objects.Add({object::kRatedCurrent, 0}, 4, kRw, config.rated_current());
  objects.Add({object::kRatedTorque, 0}, 4, kRw, config.rated_torque());
  objects.Add({object::kSupportedModes, 0}, 4, ObjectDictionary::kReadOnly,
              1U << (kModeCyclicTorque - 1));
  Schedule(DriveState::kSwitchOnDisabled, 0);
  Report();
}

void EmulatedDrive::TriggerFault(uint16_t error) {
  if (state_ == DriveState::kFaultReactionActive || state_ == DriveState::kFault) return;
  error_code_->value = error;
  emergency_ = error;
  Enter(DriveState::kFaultReactionActive);
  Schedule(DriveState::kFault, now_);
}

std::optional<uint16_t> EmulatedDrive::TakeEmergency() {
  return std::exchange(emergency_, std::nullopt);
}

void EmulatedDrive::Enter(DriveState state) {
  state_ = state;
  next_.reset();
}

void EmulatedDrive::Schedule(DriveState state, int64_t now) {
  if (next_ == state) return;
  next_ = state;
  next_time_ = now + static_cast<int64_t>(config_.transition_time() * kNanosecondsPerMs);
}

void EmulatedDrive::AdvanceTo(int64_t now, bool outputs_valid) {
  const double elapsed_ms =
      static_cast<double>(std::max<int64_t>(now - now_, 0)) / kNanosecondsPerMs;
  now_ = std::max(now, now_);
  UpdateState(now_, outputs_valid);
  UpdateTorque(elapsed_ms);
  Report();
}

void EmulatedDrive::UpdateState(int64_t now, bool outputs_valid) {
  const auto controlword = static_cast<uint16_t>(controlword_->value);
  const bool reset_edge =
      (controlword & ~last_controlword_ & kControlFaultReset) != 0 && outputs_valid;
  last_controlword_ = controlword;
  const bool powered = state_ == DriveState::kSwitchedOn ||
                       state_ == DriveState::kOperationEnabled ||
                       state_ == DriveState::kQuickStopActive;
  if (powered && !outputs_valid) TriggerFault(kErrorCommunication);
  if (sto_ && (powered || state_ == DriveState::kReadyToSwitchOn)) {
    Enter(DriveState::kSwitchOnDisabled);
  }
  if (next_ && now >= next_time_) Enter(*next_);
  if (outputs_valid) Follow(controlword, reset_edge, now);
  // Another mode is not supported: the drive stays in the one it has.
  const bool change = outputs_valid && static_cast<int8_t>(mode_->value) == kModeCyclicTorque &&
                      mode_display_->value != mode_->value;
  if (!change) {
    mode_wanted_at_ = now;
  } else if (now - mode_wanted_at_ >=
             static_cast<int64_t>(config_.mode_time() * kNanosecondsPerMs)) {
    mode_display_->value = mode_->value;
  }
}

void EmulatedDrive::Follow(uint16_t controlword, bool reset_edge, int64_t now) {
  const bool voltage = (controlword & 0x02) != 0;
  const bool no_quick_stop = (controlword & 0x04) != 0;
  const bool switch_on = (controlword & 0x01) != 0;
  const bool enable = (controlword & 0x08) != 0;
  const bool shutdown_or_more = voltage && no_quick_stop;
  std::optional<DriveState> wanted;
  switch (state_) {
    case DriveState::kSwitchOnDisabled:
      if (shutdown_or_more && !switch_on && !sto_) wanted = DriveState::kReadyToSwitchOn;
      break;
    case DriveState::kReadyToSwitchOn:
      if (!shutdown_or_more) {
        Enter(DriveState::kSwitchOnDisabled);
      } else if (switch_on) {
        wanted = DriveState::kSwitchedOn;
      }
      break;
    case DriveState::kSwitchedOn:
      if (!shutdown_or_more) {
        Enter(DriveState::kSwitchOnDisabled);
      } else if (!switch_on) {
        Enter(DriveState::kReadyToSwitchOn);
      } else if (enable) {
        wanted = DriveState::kOperationEnabled;
      }
      break;
    case DriveState::kOperationEnabled:
      // Ways out of it take no time: torque ends with the command.
      if (!voltage) {
        Enter(DriveState::kSwitchOnDisabled);
      } else if (!no_quick_stop) {
        Enter(DriveState::kQuickStopActive);
      } else if (!switch_on) {
        Enter(DriveState::kReadyToSwitchOn);
      } else if (!enable) {
        Enter(DriveState::kSwitchedOn);
      }
      return;
    case DriveState::kQuickStopActive:
      // 605A = 2: once stopped, switch on disabled.
      if (!voltage) {
        Enter(DriveState::kSwitchOnDisabled);
      } else {
        Schedule(DriveState::kSwitchOnDisabled, now);
      }
      return;
    case DriveState::kFault:
      if (reset_edge) {
        error_code_->value = 0;
        Enter(DriveState::kSwitchOnDisabled);
      }
      return;
    case DriveState::kNotReadyToSwitchOn:
    case DriveState::kFaultReactionActive:
    case DriveState::kUnknown:
      return;  // left by themselves
  }
  if (wanted) {
    Schedule(*wanted, now);
  } else {
    next_.reset();
  }
}

double EmulatedDrive::TorqueLimit(double elapsed_ms) {
  // I²t above the rating: full after peak_time at the peak, empty after as long without torque.
  const double peak = std::max(1.0, config_.peak_torque() * 1e-3);
  const double per_unit = torque_ * 1e-3;
  const double budget = std::max(peak * peak - 1, 1e-3) * config_.peak_time();
  heat_ = std::clamp(heat_ + (per_unit * per_unit - 1) * elapsed_ms * 1e-3 / budget, 0.0, 1.0);
  if (heat_ >= 1) overheated_ = true;
  if (heat_ <= 0) overheated_ = false;
  const double thermal = overheated_ ? 1000.0 : config_.peak_torque();
  return std::min({static_cast<double>(max_torque_->value & 0xFFFF),
                   static_cast<double>(config_.peak_torque()), thermal});
}

void EmulatedDrive::UpdateTorque(double elapsed_ms) {
  const double limit = TorqueLimit(elapsed_ms);
  limited_ = false;
  double wanted = 0;
  const bool follows = state_ == DriveState::kOperationEnabled &&
                       static_cast<int8_t>(mode_display_->value) == kModeCyclicTorque;
  if (follows) {
    const auto target = static_cast<double>(static_cast<int16_t>(target_torque_->value));
    wanted = std::clamp(target, -limit, limit);
    limited_ = wanted != target;
    const double step = config_.torque_slew() * elapsed_ms;
    // A limit acts at once, a target through the slew.
    torque_ = std::clamp(torque_, -limit, limit);
    torque_ += std::clamp(wanted - torque_, -step, step);
  } else {
    torque_ = 0;
  }
  greatest_torque_ = std::max(greatest_torque_, std::abs(torque_));
  load_->SetTorque(torque_ * 1e-3 * config_.rated_torque() * 1e-3);
}

void EmulatedDrive::Report() {
  uint16_t status = EncodeState(state_);
  status |= kStatusRemote;
  if (!sto_) status |= kStatusVoltageEnabled;
  if (limited_) status |= kStatusInternalLimit;
  const bool follows = state_ == DriveState::kOperationEnabled &&
                       static_cast<int8_t>(mode_display_->value) == kModeCyclicTorque;
  if (follows) status |= kStatusFollows;
  statusword_->value = status;
  torque_object_->value = static_cast<uint16_t>(std::lround(torque_));
  if (frozen_) return;
  if (!std::isfinite(load_->position()) || !std::isfinite(load_->velocity())) {
    TriggerFault(kErrorFeedback);
    return;
  }
  position_->value = Counts(load_->position(), config_.encoder_counts());
  velocity_->value = Counts(load_->velocity(), config_.encoder_counts());
}

}  // namespace poise::ethercat
