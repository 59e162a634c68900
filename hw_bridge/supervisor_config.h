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

  /// Cycles of a time, at least the time.
  int Cycles(double seconds) const { return static_cast<int>(std::ceil(seconds / period - 1e-9)); }
};

}  // namespace poise
