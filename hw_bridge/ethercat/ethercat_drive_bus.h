// The drive bus of real drives: EtherCAT and CiA 402 behind currents and counts by joint.
#pragma once

#include <bitset>
#include <cstdint>
#include <memory>
#include <vector>

#include "components/robot/robot_model.h"
#include "hw_bridge/drive_bus.h"
#include "hw_bridge/ethercat/cia402.h"
#include "hw_bridge/ethercat/drive_scale.h"
#include "hw_bridge/ethercat/master.h"

namespace poise::ethercat {

/// The sensors of the robot that are no drives: IMU and feet.
class SensorSource {
 public:
  virtual ~SensorSource() = default;
  /// Fills imu_* and foot_wrench. False: nothing arrived. Must not block, allocate or throw.
  virtual bool Read(drive_feedback_t* feedback) = 0;
};

/// `config` with what the robot says of its motors where a drive does not say it. Throws
/// EthercatError: a joint without a drive or with two, a drive of no joint, ratings that differ
/// from the robot's by more than 1 %.
MasterConfig CompleteMasterConfig(MasterConfig config, const robot::RobotModel& model);

/// How the bus has been of late.
struct BusHealth {
  bool usable = true;    ///< false, for good: too many bad cycles in a row or of the last 100
  int bad_in_a_row = 0;  ///< cycles without usable inputs
  int bad_in_100 = 0;    ///< of the last 100
  int64_t cycles = 0, bad_cycles = 0;
  uint8_t al_status = 0;         ///< of all slaves, or-ed; 0x08: all in OP
  int64_t refused_currents = 0;  ///< that were not finite, sent as zero
};

/// Start, then Receive and Send once a cycle each, then Stop. Target and greatest torque (6071,
/// 6072) are zero until every drive that is to be enabled is, in cyclic synchronous torque; drives
/// of faulted or disabled joints get none. Receive returns nullptr in a cycle whose inputs are not
/// whole. In it DRIVE_FAULT stands for a fault, STO, a mode that is not the one commanded, and a
/// chain that is not in OP.
class EthercatDriveBus final : public DriveBus {
 public:
  /// All but the configuration must outlive this; `sensors` may be nullptr. Throws EthercatError.
  EthercatDriveBus(Link* link, const EthercatBusConfig& config, const robot::RobotModel& model,
                   SensorSource* sensors);

  /// Leads the chain to OP without torque. Blocks; throws EthercatError.
  void Start() { master_.Start(); }
  /// Takes all torque and leads the chain to INIT. Blocks. False when not all slaves got there.
  bool Stop();

  const drive_feedback_t* Receive() override;
  void Send(const drive_command_t& command) override;

  /// Resets the faults of all drives by one edge, the drives being commanded disabled.
  void RequestFaultReset();
  const BusHealth& health() const { return health_; }
  /// Of the drive of a joint, as last received.
  DriveState drive_state(size_t joint) const { return drives_[joint].state; }
  /// ns by which the next cycle should start later (negative: earlier) than a period after this
  /// one, so that it keeps its place in the drives' common time; 0 without distributed clocks.
  int64_t cycle_correction() const { return cycle_correction_; }
  const Master& master() const { return master_; }

 private:
  struct Drive {
    size_t slave = 0;  // its place in the chain
    DriveScale scale;
    uint16_t max_torque = 0;  // per mille, of the peak current
    DriveControl control;
    CounterUnwrap counter;
    DriveState state = DriveState::kUnknown;
    bool in_mode = false;    // cyclic synchronous torque is the mode it shows
    bool commanded = false;  // to be enabled
  };

  /// Takes what has come of the last frame; the result of the exchange that has inputs.
  CycleResult ReceiveFrames();
  void Judge(const CycleResult& result);
  int32_t Status(const Drive& drive, uint16_t statusword) const;

  EthercatBusConfig config_;
  Master master_;
  Link* link_;
  SensorSource* sensors_;
  CycleSteering steering_;
  std::vector<Drive> drives_;  // by joint
  drive_feedback_t feedback_;
  bool sent_ = false;      // a frame of the last Send is under way
  bool released_ = false;  // all drives to be enabled have been
  BusHealth health_;
  std::bitset<100> bad_;  // by cycle, modulo 100
  int64_t cycle_correction_ = 0;
};

}  // namespace poise::ethercat
