#include "hw_bridge/ethercat/emulator/emulated_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace poise::ethercat {
namespace {

constexpr double kNanosecondsPerMs = 1e6;
// s that the motor bears the peak torque before I²t holds it to the rated one, and how fast it
// recovers: that of servo motors of this size.
constexpr double kPeakTime = 3;
// Per mille of rated torque in a ms: the current loop's bandwidth, about 1 kHz, reaches the peak in
// under 1 ms.
constexpr double kTorqueSlew = 3000;
constexpr double kMostShown = 32767;  // per mille, of an INTEGER16
constexpr uint8_t kRw = ObjectDictionary::kWritable;
constexpr uint8_t kRx = ObjectDictionary::kWritable | ObjectDictionary::kRxMappable;
constexpr uint8_t kTx = ObjectDictionary::kTxMappable;

/// Counts of a shaft's angle, wrapping around at 32 bits as the drive's counter does.
uint32_t Counts(double angle, uint32_t counts_per_turn) {
  const double counts = std::floor(angle / (2 * std::numbers::pi) * counts_per_turn);
  return static_cast<uint32_t>(static_cast<int64_t>(std::fmod(counts, 4294967296.0)));
}

/// The state that a controlword's bits lead to, of a drive without a fault.
DriveState AskedFor(uint16_t controlword) {
  if ((controlword & 0x02) == 0) return DriveState::kSwitchOnDisabled;
  if ((controlword & 0x04) == 0) return DriveState::kQuickStopActive;
  if ((controlword & 0x01) == 0) return DriveState::kReadyToSwitchOn;
  return (controlword & 0x08) == 0 ? DriveState::kSwitchedOn : DriveState::kOperationEnabled;
}

}  // namespace

EmulatedDrive::EmulatedDrive(const EmulatedDriveConfig& config, ObjectDictionary* dictionary,
                             MotorLoad* load)
    : config_(config), load_(load) {
  constexpr uint8_t kReadOnly = ObjectDictionary::kReadOnly;
  constexpr uint32_t kQuickStopSlowDown = 2;  // then switch on disabled
  const auto add = [&](uint16_t index, uint8_t size, uint8_t access, const char* name,
                       uint32_t value = 0) {
    Object* const object =
        (Lacks(index) ? &hidden_ : dictionary)->Add({index, 0}, size, access, value);
    object->name = name;
    return object;
  };
  controlword_ = add(object::kControlword, 2, kRx, "Controlword");
  statusword_ = add(object::kStatusword, 2, kTx, "Statusword");
  mode_ = add(object::kModeOfOperation, 1, kRx, "Modes of operation");
  mode_display_ = add(object::kModeDisplay, 1, kTx, "Modes of operation display");
  target_torque_ = add(object::kTargetTorque, 2, kRx, "Target torque");
  max_torque_ = add(object::kMaxTorque, 2, kRx, "Max torque", config.peak_torque());
  torque_object_ = add(object::kTorque, 2, kTx, "Torque actual value");
  position_ = add(object::kPosition, 4, kTx, "Position actual value");
  velocity_ = add(object::kVelocity, 4, kTx, "Velocity actual value");
  error_code_ = add(object::kErrorCode, 2, kTx, "Error code");
  error_register_ = add(0x1001, 1, kReadOnly, "Error register");
  Object* const target_position = add(object::kTargetPosition, 4, kRx, "Target position");
  Object* const target_velocity = add(object::kTargetVelocity, 4, kRx, "Target velocity");
  Object* const quick_stop = add(0x605A, 2, kRw, "Quick stop option code", kQuickStopSlowDown);
  add(0x6073, 2, kRw, "Max current", config.peak_torque());
  add(object::kRatedCurrent, 4, kRw, "Motor rated current", config.rated_current());
  add(object::kRatedTorque, 4, kRw, "Motor rated torque",
      config.rated_torque() * config.torque_unit());
  add(0x6087, 4, kRw, "Torque slope", static_cast<uint32_t>(1e3 * kTorqueSlew));
  add(object::kSupportedModes, 4, kReadOnly, "Supported drive modes",
      1U << (kModeCyclicTorque - 1));
  // Interpolation time period: 2 x 10^-3 s.
  if (!Lacks(0x60C2)) {
    dictionary->Add({0x60C2, 0}, 1, kReadOnly, 2)->name = "Interpolation time period";
    dictionary->Add({0x60C2, 1}, 1, kRw, 2);
    dictionary->Add({0x60C2, 2}, 1, kRw, 0xFD)->is_signed = true;
  }
  for (Object* object : {mode_, mode_display_, target_torque_, torque_object_, position_, velocity_,
                         target_position, target_velocity, quick_stop}) {
    object->is_signed = true;
  }
  const auto in_range = [](bool good) { return good ? SdoAbort::kNone : SdoAbort::kValueRange; };
  mode_->on_write = [in_range](uint32_t mode) {  // one of 6502, or none
    return in_range(mode == 0 || mode == static_cast<uint32_t>(kModeCyclicTorque));
  };
  quick_stop->on_write = [in_range](uint32_t code) { return in_range(code <= 8 && code != 4); };
  Schedule(DriveState::kSwitchOnDisabled);
  Report();
}

bool EmulatedDrive::Lacks(uint16_t index) const {
  return config_.other() || std::ranges::find(config_.lacks(), index) != config_.lacks().end();
}

void EmulatedDrive::TriggerFault(uint16_t error) {
  if (state_ == DriveState::kFaultReactionActive || state_ == DriveState::kFault) return;
  error_code_->value = error;
  error_register_->value = 1;  // a generic error
  emergency_ = error;
  Enter(DriveState::kFaultReactionActive);
  Schedule(DriveState::kFault);
}

void EmulatedDrive::Enter(DriveState state) {
  state_ = state;
  next_.reset();
}

void EmulatedDrive::Schedule(DriveState state) {
  if (next_ == state) return;
  next_ = state;
  next_time_ = now_ + static_cast<int64_t>(config_.transition_time() * kNanosecondsPerMs);
}

void EmulatedDrive::AdvanceTo(int64_t now, bool outputs_valid) {
  const double elapsed_ms =
      static_cast<double>(std::max<int64_t>(now - now_, 0)) / kNanosecondsPerMs;
  now_ = std::max(now, now_);
  load_->AdvanceTo(now_);
  UpdateState(outputs_valid);
  UpdateTorque(elapsed_ms);
  Report();
}

void EmulatedDrive::UpdateState(bool outputs_valid) {
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
  if (next_ && now_ >= next_time_) Enter(*next_);
  if (outputs_valid) Follow(controlword, reset_edge);
  // Another mode is not supported: the drive stays in the one it has.
  const bool change = static_cast<int8_t>(mode_->value) == kModeCyclicTorque &&
                      mode_display_->value != mode_->value;
  if (!change) {
    mode_wanted_at_ = now_;
  } else if (now_ - mode_wanted_at_ >=
             static_cast<int64_t>(config_.mode_time() * kNanosecondsPerMs)) {
    mode_display_->value = mode_->value;
  }
}

void EmulatedDrive::Follow(uint16_t controlword, bool reset_edge) {
  const DriveState asked = AskedFor(controlword);
  std::optional<DriveState> wanted;
  switch (state_) {
    case DriveState::kSwitchOnDisabled:
      if (asked == DriveState::kReadyToSwitchOn && !sto_) wanted = asked;
      break;
    case DriveState::kReadyToSwitchOn:
    case DriveState::kSwitchedOn: {
      // Up by one state at a time, down at once.
      const DriveState target =
          asked == DriveState::kQuickStopActive ? DriveState::kSwitchOnDisabled : asked;
      if (target > state_) {
        wanted = static_cast<DriveState>(static_cast<int>(state_) + 1);
      } else if (target < state_) {
        Enter(target);
      }
      break;
    }
    case DriveState::kOperationEnabled:
      // Ways out of it take no time: torque ends with the command.
      if (asked != state_) Enter(asked);
      return;
    case DriveState::kQuickStopActive:
      // 605A = 2: once stopped, switch on disabled.
      if (asked == DriveState::kSwitchOnDisabled) {
        Enter(asked);
      } else {
        Schedule(DriveState::kSwitchOnDisabled);
      }
      return;
    case DriveState::kFault:
      if (reset_edge) {
        error_code_->value = 0;
        error_register_->value = 0;
        Enter(DriveState::kSwitchOnDisabled);
      }
      return;
    case DriveState::kNotReadyToSwitchOn:
    case DriveState::kFaultReactionActive:
    case DriveState::kUnknown:
      return;  // left by themselves
  }
  if (wanted) {
    Schedule(*wanted);
  } else {
    next_.reset();
  }
}

double EmulatedDrive::TorqueLimit(double elapsed_ms) {
  // I²t above the rating: full after kPeakTime at the peak, empty after as long without torque.
  const double peak = std::max(1.0, config_.peak_torque() * 1e-3);
  const double per_unit = torque_ * 1e-3;
  const double budget = std::max(peak * peak - 1, 1e-3) * kPeakTime;
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
  if (follows()) {
    const auto target = static_cast<double>(static_cast<int16_t>(target_torque_->value));
    wanted = std::clamp(target, -limit, limit);
    limited_ = wanted != target;
    const double step = kTorqueSlew * elapsed_ms;
    // A limit acts at once, a target through the slew.
    torque_ = std::clamp(torque_, -limit, limit);
    torque_ += std::clamp(wanted - torque_, -step, step);
  } else {
    torque_ = 0;
  }
  load_->SetTorque(torque_ * 1e-3 * config_.rated_torque() * 1e-3);
}

void EmulatedDrive::Report() {
  uint16_t status = EncodeState(state_);
  status |= kStatusRemote;
  if (!sto_) status |= kStatusVoltageEnabled;
  if (limited_) status |= kStatusInternalLimit;
  if (follows()) status |= kStatusFollows;
  statusword_->value = status;
  const double rated = config_.rated_torque() * 1e-6;  // N·m of one per mille
  const double shown = load_->MeasuredTorque(torque_ * rated) / rated;
  torque_object_->value = static_cast<uint16_t>(
      static_cast<int16_t>(std::lround(std::clamp(shown, -kMostShown, kMostShown))));
  if (frozen_) return;
  if (!std::isfinite(load_->position()) || !std::isfinite(load_->velocity())) {
    TriggerFault(kErrorFeedback);
    return;
  }
  position_->value = Counts(load_->position(), config_.encoder_counts());
  velocity_->value = Counts(load_->velocity(), config_.encoder_counts());
}

}  // namespace poise::ethercat
