// What the bridge derives from the robot where its configuration says nothing:
// docs/reference/robots.md has each rule and its reason.
#pragma once

#include <vector>

#include "components/robot/robot_model.h"

namespace poise {

struct RobotThresholds {
  double slew_limit = 0;     ///< N·m/s
  double torque_error = 0;   ///< N·m
  double frozen_torque = 0;  ///< N·m
  // By joint:
  std::vector<double> hold_stiffness;  ///< N·m/rad
  std::vector<double> hold_damping;    ///< N·m·s/rad
  std::vector<double> damping;         ///< N·m·s/rad, of the bridge's state DAMPING
  /// N·m/rad and N·m·s/rad, the largest that a drive is told to close.
  std::vector<double> stiffness_limit, damping_limit;
};

RobotThresholds DeriveThresholds(const robot::RobotModel& model);

}  // namespace poise
