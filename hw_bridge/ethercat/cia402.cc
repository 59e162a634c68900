#include "hw_bridge/ethercat/cia402.h"

namespace poise::ethercat {
namespace {

/// By DriveState: the bits of a statusword that tell a state, and what they are in it.
struct StateCode {
  std::string_view name;
  uint16_t mask, bits;
};
constexpr StateCode kStates[kNumDriveStates] = {
    {"unknown", 0, 0},
    {"not ready to switch on", 0x4F, 0x00},
    {"switch on disabled", 0x4F, 0x40},
    {"ready to switch on", 0x6F, 0x21},
    {"switched on", 0x6F, 0x23},
    {"operation enabled", 0x6F, 0x27},
    {"quick stop active", 0x6F, 0x07},
    {"fault reaction active", 0x4F, 0x0F},
    {"fault", 0x4F, 0x08},
};

}  // namespace

std::string_view Name(DriveState state) { return kStates[static_cast<size_t>(state)].name; }

DriveState DecodeState(uint16_t statusword) {
  for (int i = 1; i < kNumDriveStates; ++i) {
    if ((statusword & kStates[i].mask) == kStates[i].bits) return static_cast<DriveState>(i);
  }
  return DriveState::kUnknown;
}

uint16_t EncodeState(DriveState state) { return kStates[static_cast<size_t>(state)].bits; }

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
    default:  // a quick stop included: out of it, without torque; then enabled anew
      return kControlDisableVoltage;
  }
}

}  // namespace poise::ethercat
