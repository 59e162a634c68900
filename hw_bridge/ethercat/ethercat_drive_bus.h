// The drive bus of real drives: EtherCAT and CiA 402 behind currents and counts by joint.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "components/robot/robot_model.h"
#include "hw_bridge/drive/cycle_judge.h"
#include "hw_bridge/drive/drive_bus.h"
#include "hw_bridge/drive/drive_bus_type.h"
#include "hw_bridge/ethercat/cia402.h"
#include "hw_bridge/ethercat/drive_scale.h"
#include "hw_bridge/ethercat/links/pcap.h"
#include "hw_bridge/ethercat/master.h"

namespace poise::ethercat {

/// `config` with what the robot says of its motors where a drive does not say it. Throws
/// EthercatError: a joint without a drive or with two, a drive of no joint, ratings that differ
/// from the robot's by more than 1 %. No drive at all: one for each joint, in the robot's order.
MasterConfig CompleteMasterConfig(MasterConfig config, const robot::RobotModel& model);

/// Opens the configured link. Throws EthercatError.
using LinkOpener = std::function<std::unique_ptr<Link>(const LinkConfig& config)>;

/// Target and greatest torque (6071, 6072) are zero until every drive that is to be enabled is, in
/// cyclic synchronous torque; drives of faulted or disabled joints get none, and a quick stop when
/// they are enabled. Receive gives counts, currents and states, of sensors what other slaves of the
/// bus read, and nullptr in a cycle whose inputs are not whole. In it DRIVE_FAULT stands for a
/// fault, STO, a mode that is not the one commanded, and a chain that is not in OP.
class EthercatDriveBus final : public DriveBus {
 public:
  /// Throws EthercatError.
  EthercatDriveBus(LinkOpener open_link, const EthercatBusConfig& config,
                   const robot::RobotModel& model);

  /// Opens the link and leads the chain to OP without torque; waits for one that is not there yet.
  /// Throws EthercatError.
  void Start() override;
  /// Leads the chain to INIT, and ends the capture.
  std::string Stop() override;
  void Idle(bool enable) override;
  void AwaitNextCycle() override;

  const drive_feedback_t* Receive() override;
  void Send(const drive_command_t& command) override;

  std::span<const DriveReport> reports() const override { return reports_; }
  const BusHealth& health() const override { return health_; }
  void RequestFaultReset() override;
  /// 0 without distributed clocks.
  int64_t cycle_correction() const override { return cycle_correction_; }
  int num_slaves() const override { return static_cast<int>(master_.num_slaves()); }
  void Diagnose(bus_status_t* status) const override;
  SensorsOfBus sensors() const override { return sensors_; }

 private:
  struct Drive {
    size_t slave = 0;  // its place in the chain
    DriveScale scale;
    uint16_t max_torque = 0;  // per mille, of the peak current
    DriveControl control = {};
    CounterUnwrap counter = {};
    DriveState state = DriveState::kUnknown;
    bool in_mode = false;    // cyclic synchronous torque is the mode it shows
    bool commanded = false;  // to be enabled
  };

  /// A sensor's number in the process data, and where it belongs.
  struct Reading {
    ProcessImage::Place place;
    SensorReading config;
  };

  void FindReadings(size_t num_feet);
  double* Target(const SensorReading& reading);
  /// Takes what has come of the last frame; the result of the exchange that has inputs.
  CycleResult ReceiveFrames();
  void TakeInputs();
  int32_t Status(const Drive& drive, uint16_t statusword) const;

  LinkOpener open_link_;
  EthercatBusConfig config_;
  std::unique_ptr<Link> link_;      // from Start on
  CaptureLink* capture_ = nullptr;  // the same, where frames are captured
  Master master_;
  CycleSteering steering_;
  std::vector<Drive> drives_;  // by joint
  std::vector<Reading> readings_;
  SensorsOfBus sensors_;
  std::vector<DriveReport> reports_;
  drive_feedback_t feedback_;
  drive_command_t idle_;               // no torque
  bool sent_ = false;                  // a frame of the last Send is under way
  std::optional<CycleResult> answer_;  // to it, when it has been waited for
  bool released_ = false;              // all drives to be enabled have been
  BusHealth health_;
  CycleJudge judge_;
  FrameCounts before_;  // the first cycle
  int64_t short_counters_before_ = 0;
  int64_t cycle_start_ = 0, cycle_correction_ = 0;
};

/// hw_bridge.ethercat, on sockets unless another opener is given.
DriveBusType EthercatBusType(LinkOpener open_link = nullptr);

}  // namespace poise::ethercat
