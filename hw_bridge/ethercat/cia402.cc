#include "hw_bridge/ethercat/cia402.h"

#include <array>

namespace poise::ethercat {

std::string_view Name(DriveState state) {
  constexpr std::array<std::string_view, kNumDriveStates> kNames = {"not ready to switch on",
                                                                    "switch on disabled",
                                                                    "ready to switch on",
                                                                    "switched on",
                                                                    "operation enabled",
                                                                    "quick stop active",
                                                                    "fault reaction active",
                                                                    "fault",
                                                                    "unknown"};
  return kNames[static_cast<size_t>(state)];
}

DriveState DecodeState(uint16_t statusword) {
  switch (statusword & 0x4F) {
    case 0x00:
      return DriveState::kNotReadyToSwitchOn;
    case 0x40:
      return DriveState::kSwitchOnDisabled;
    case 0x0F:
      return DriveState::kFaultReactionActive;
    case 0x08:
      return DriveState::kFault;
    default:
      break;
  }
  switch (statusword & 0x6F) {
    case 0x21:
      return DriveState::kReadyToSwitchOn;
    case 0x23:
      return DriveState::kSwitchedOn;
    case 0x27:
      return DriveState::kOperationEnabled;
    case 0x07:
      return DriveState::kQuickStopActive;
    default:
      return DriveState::kUnknown;
  }
}

uint16_t EncodeState(DriveState state) {
  constexpr std::array<uint16_t, kNumDriveStates> kBits = {0x00, 0x40, 0x21, 0x23, 0x27,
                                                           0x07, 0x0F, 0x08, 0x00};
  return kBits[static_cast<size_t>(state)];
}

uint16_t DriveControl::Controlword(DriveState state, DriveGoal goal) {
  if (reset_ == Reset::kLow) {
    reset_ = Reset::kHigh;
    return kControlDisableVoltage;
  }
  if (reset_ == Reset::kHigh) {
    reset_ = Reset::kNone;
    return kControlFaultReset;
  }
  if (goal == DriveGoal::kDisabled) return kControlDisableVoltage;
  if (goal == DriveGoal::kQuickStop) {
    // From a state that is not enabled there is nothing to stop.
    const bool enabled =
        state == DriveState::kOperationEnabled || state == DriveState::kQuickStopActive;
    return enabled ? kControlQuickStop : kControlDisableVoltage;
  }
  switch (state) {
    case DriveState::kSwitchOnDisabled:
      return kControlShutdown;
    case DriveState::kReadyToSwitchOn:
      return kControlSwitchOn;
    case DriveState::kSwitchedOn:
    case DriveState::kOperationEnabled:
      return kControlEnable;
    case DriveState::kQuickStopActive:
      return kControlDisableVoltage;  // out of it, without torque; then enabled anew
    default:
      return kControlDisableVoltage;
  }
}

}  // namespace poise::ethercat
