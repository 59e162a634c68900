// EmulatedDrive: a servo drive of CiA 402 behind its object dictionary.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "hw_bridge/ethercat/cia402.h"
#include "hw_bridge/ethercat/emulator/emulator.pb.h"
#include "hw_bridge/ethercat/emulator/object_dictionary.h"
#include "hw_bridge/ethercat/process_image.h"

namespace poise::ethercat {

/// What a drive's motor turns: takes torque, gives the shaft's motion.
class MotorLoad {
 public:
  virtual ~MotorLoad() = default;
  /// Lets time pass with the torque as it is; ns, never decreasing.
  virtual void AdvanceTo(int64_t now) { static_cast<void>(now); }
  /// N·m at the motor shaft, held until the next call.
  virtual void SetTorque(double torque) = 0;
  virtual double position() const = 0;  ///< rad, of the motor shaft
  virtual double velocity() const = 0;  ///< rad/s
  /// N·m at the motor shaft that the drive's current sensor shows, while it gives `given`.
  virtual double MeasuredTorque(double given) const { return given; }
};

/// Error codes of 603F that the emulation gives (CiA 402, annex).
inline constexpr uint16_t kErrorOverCurrent = 0x2310;
inline constexpr uint16_t kErrorCommunication = 0x8130;  ///< life guard
inline constexpr uint16_t kErrorFeedback = 0x7300;

/// Its state follows the controlword, each transition after a delay. In operation enabled and
/// cyclic synchronous torque the torque follows 6071 within 6072, the peak, I²t and the slew; in
/// every other state it is zero, at once.
class EmulatedDrive {
 public:
  /// `load` and `dictionary` must outlive this.
  EmulatedDrive(const EmulatedDriveConfig& config, ObjectDictionary* dictionary, MotorLoad* load);

  /// Lets time pass, in ns since the start. `outputs_valid`: the slave is in OP.
  void AdvanceTo(int64_t now, bool outputs_valid);

  /// Trips the drive: fault reaction, then fault. `error`: for 603F.
  void TriggerFault(uint16_t error);
  /// Safe torque off: no torque while it is active, and no way out of switch on disabled.
  void SetSto(bool active) { sto_ = active; }
  /// The position sensor keeps showing what it shows now.
  void FreezeEncoder(bool frozen) { frozen_ = frozen; }

  DriveState state() const { return state_; }
  /// A fault's code, once for each fault.
  std::optional<uint16_t> TakeEmergency() { return std::exchange(emergency_, std::nullopt); }

 private:
  bool Lacks(uint16_t index) const;  // all, in a slave that is no drive
  void UpdateState(bool outputs_valid);
  void Follow(uint16_t controlword, bool reset_edge);
  void Enter(DriveState state);
  void Schedule(DriveState state);
  void UpdateTorque(double elapsed_ms);
  double TorqueLimit(double elapsed_ms);
  void Report();
  /// Whether the target torque counts.
  bool follows() const {
    return state_ == DriveState::kOperationEnabled &&
           static_cast<int8_t>(mode_display_->value) == kModeCyclicTorque;
  }

  EmulatedDriveConfig config_;
  MotorLoad* load_;
  using Object = ObjectDictionary::Object;
  Object *controlword_, *statusword_, *mode_, *mode_display_, *target_torque_, *max_torque_,
      *torque_object_, *position_, *velocity_, *error_code_, *error_register_;
  ObjectDictionary hidden_;  // what the drive has, but not for a master

  DriveState state_ = DriveState::kNotReadyToSwitchOn;
  std::optional<DriveState> next_;  // entered at next_time_
  int64_t next_time_ = 0;           // ns
  int64_t mode_wanted_at_ = 0;      // ns
  int64_t now_ = 0;                 // ns
  uint16_t last_controlword_ = 0;
  bool sto_ = false, frozen_ = false;
  bool limited_ = false;  // an internal limit holds the torque back
  double torque_ = 0;     // per mille
  double heat_ = 0;       // I²t: share of what the motor bears above its rating, 0 to 1
  bool overheated_ = false;
  std::optional<uint16_t> emergency_;
};

}  // namespace poise::ethercat
