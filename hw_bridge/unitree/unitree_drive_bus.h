// The drive bus of a Unitree humanoid: states and commands behind currents and counts by joint.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "components/robot/robot_model.h"
#include "hw_bridge/drive/cycle_judge.h"
#include "hw_bridge/drive/drive_bus.h"
#include "hw_bridge/drive/drive_bus_type.h"
#include "hw_bridge/unitree/robot_link.h"
#include "hw_bridge/unitree/unitree.pb.h"

namespace poise::unitree {

/// Opens the link to a robot. Throws UnitreeError.
using RobotLinkOpener = std::function<std::unique_ptr<RobotLink>(const DdsLink& link)>;

/// Motors that are commanded enabled get torque (clamped to the motor's peak), position, velocity,
/// stiffness and damping; others damp with rest_damping, and one that reports an error is free.
/// Commands carry mode_machine as the robot says it, and the check sum. Receive gives counts of the
/// positions, currents of the estimated torques and the IMU's readings, and nullptr in a cycle
/// without a state that is new and whole. A motor's error is a drive's fault; its temperature and
/// voltage, the remote's stop buttons and another mode_machine ask for a stop.
class UnitreeDriveBus final : public DriveBus {
 public:
  /// `period`, s, of a cycle. Throws UnitreeError.
  UnitreeDriveBus(RobotLinkOpener open_link, const UnitreeBusConfig& config,
                  const robot::RobotModel& model, double period);

  /// Opens the link, waits for the robot's states and until no controller of the maker's moves it.
  void Start() override;
  /// Leaves the motors damping.
  std::string Stop() override;
  void Idle(bool enable) override;
  void AwaitNextCycle() override;
  const drive_feedback_t* Receive() override;
  void Send(const drive_command_t& command) override { SendMotors(&command); }
  bool impedance() const override { return true; }
  SensorsOfBus sensors() const override { return {.imu = true, .feet = true, .velocity = true}; }
  std::span<const DriveReport> reports() const override { return reports_; }
  const BusHealth& health() const override { return health_; }
  void RequestFaultReset() override;
  int num_slaves() const override { return static_cast<int>(motors_.size()); }
  void Diagnose(bus_status_t* status) const override;
  int64_t cycle_correction() const override { return cycle_correction_; }

 private:
  struct Motor {
    size_t slot = 0;
    robot::MotorModel model;
  };

  void Release(int64_t deadline);
  /// Takes the newest state that has come, whole and newer than the last; waits for one until
  /// `deadline`. In simulated time, `in_run`, one of the run's cycles.
  bool ReceiveState(int64_t deadline, bool in_run = false);
  void TakeState();
  void TakeMotors();
  void TakeImu();
  void SendMotors(const drive_command_t* command, bool enable = false);
  MotorCmd CommandOf(size_t joint, const drive_command_t& command);

  RobotLinkOpener open_link_;
  std::unique_ptr<RobotLink> link_;  // from Start on
  UnitreeBusConfig config_;
  int64_t period_;  // ns
  uint16_t stop_buttons_;
  std::vector<Motor> motors_;  // by joint
  std::vector<DriveReport> reports_;
  drive_feedback_t feedback_;
  LowState incoming_{}, state_{};  // as it came; the last that was whole and new
  LowCmd command_{};
  ImuState torso_imu_{};
  int64_t torso_missed_ = int64_t{1} << 40;  // states without a reading of the torso's IMU
  bool ours_ = false;                        // no controller of the maker's moves the robot
  bool early_ = false;                       // the state of the first cycle came before the cycle
  bool known_ = false;                       // a state has come
  uint32_t last_tick_ = 0;
  uint8_t mode_machine_ = 0;
  BusHealth health_;
  CycleJudge judge_;
  int64_t damaged_ = 0;  // states with a wrong check sum
  bool fresh_ = false;
  int64_t cycle_start_ = 0, cycle_correction_ = 0;
};

/// hw_bridge.unitree, on DDS unless another opener is given.
DriveBusType UnitreeBusType(RobotLinkOpener open_link = nullptr);

}  // namespace poise::unitree
