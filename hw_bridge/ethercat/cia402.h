// The state machine of a drive by CiA 402 (IEC 61800-7-201): its statusword and the controlword.
#pragma once

#include <cstdint>
#include <string_view>

namespace poise::ethercat {

/// With the values of bridge_status_t's DRIVE_*.
enum class DriveState : uint8_t {
  kUnknown,  ///< a statusword of no state
  kNotReadyToSwitchOn,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault,
};
inline constexpr int kNumDriveStates = 9;
std::string_view Name(DriveState state);

/// Bits of the statusword beside the state's.
inline constexpr uint16_t kStatusVoltageEnabled = 0x0010;
inline constexpr uint16_t kStatusRemote = 0x0200;
inline constexpr uint16_t kStatusInternalLimit = 0x0800;  ///< a limit of the drive is active
inline constexpr uint16_t kStatusFollows = 0x1000;        ///< the target of the mode is followed

DriveState DecodeState(uint16_t statusword);
/// The statusword's state bits; kUnknown: 0.
uint16_t EncodeState(DriveState state);

// Controlwords (device control commands).
inline constexpr uint16_t kControlDisableVoltage = 0x0000;
inline constexpr uint16_t kControlQuickStop = 0x0002;
inline constexpr uint16_t kControlShutdown = 0x0006;
inline constexpr uint16_t kControlSwitchOn = 0x0007;
inline constexpr uint16_t kControlEnable = 0x000F;
inline constexpr uint16_t kControlFaultReset = 0x0080;  ///< acts by its rising edge

enum class DriveGoal : uint8_t {
  kDisabled,   ///< switch on disabled: no torque
  kEnabled,    ///< operation enabled, one transition after the other
  kQuickStop,  ///< the drive stops by itself (605A), then stays without torque
};

/// Chooses the controlword of each cycle. A fault is reset only on request.
class DriveControl {
 public:
  /// The controlword that leads from what the drive reports towards `goal`.
  uint16_t Controlword(DriveState state, DriveGoal goal);
  /// Resets a fault with one rising edge: bit 7 is low for a cycle, then high for one.
  void RequestFaultReset() { reset_ = Reset::kLow; }
  bool resetting() const { return reset_ != Reset::kNone; }

 private:
  enum class Reset : uint8_t { kNone, kLow, kHigh };
  Reset reset_ = Reset::kNone;
};

}  // namespace poise::ethercat
