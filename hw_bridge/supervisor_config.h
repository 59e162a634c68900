// What the supervisor and its feedback monitor are told of the bridge's settings and of the robot.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "components/robot/robot_model.h"
#include "hw_bridge/hw_bridge.pb.h"
#include "hw_bridge/robot_thresholds.h"

namespace poise {

struct SupervisorConfig {
  HwBridgeConfig settings;  ///< but for what `thresholds` has, which it may leave to the robot
  double period = 0.002;    ///< s, of a cycle
  std::vector<robot::MotorModel> motors;  ///< by joint
  std::vector<double> torque_limit;       ///< N·m, by joint, > 0; the peak current limits too
  std::vector<double> lower, upper;       ///< rad, by joint
  std::vector<double> velocity_limit;     ///< rad/s, by joint
  RobotThresholds thresholds;             ///< the robot's, or those that the settings give
  Eigen::Vector3d upright = Eigen::Vector3d::UnitZ();  ///< up in the IMU's frame when standing
  int num_feet = 2;
  int current_cycles = 1;        ///< as old as a reading of a current may be
  bool drive_impedance = false;  ///< the drives close stiffness and damping; else the supervisor
  /// Cycles of damping without an accepted command after which the bridge stops for good (latched):
  /// at 500 Hz the first cycle in which the command is older than 25 ms.
  int stop_after_cycles = 9;
  /// s in which a command that is back is faded in: too short for the robot to move, long enough
  /// for no step.
  double resume_time = 0.02;
  /// rad/s, greatest joint speed at the start: above an encoder's noise and a hanging leg's sway.
  double start_velocity = 0.5;
  double soft_range = 0.05;     ///< rad before a joint's limit in which torque towards it fades out
  double overrun_lateness = 1;  ///< share of the period by which a cycle begins late: an overrun
  /// Cycles that overrun in a row and stop the bridge: as long without a cycle in time as the
  /// drives' own watchdog allows at 500 Hz, 50 ms; and of the last hundred.
  int overruns_in_a_row = 25, overruns_in_100 = 50;

  /// Cycles of a time, at least the time.
  int Cycles(double seconds) const { return static_cast<int>(std::ceil(seconds / period - 1e-9)); }
};

}  // namespace poise
