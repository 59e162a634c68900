// RobotModel from a Robot text file and the URDF it names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "components/robot/robot_model.h"
#include "components/robot_files/robot.pb.h"

namespace poise::robot {

/// Throws RobotError: unreadable URDF, closed loop, no such link or joint, non-physical inertia, a
/// joint type that cannot be controlled, a joint without motor, not exactly two feet, fewer than
/// six joints from base to a foot. Visual and collision elements are not looked at, so no mesh is
/// ever missed. Warnings go to `warnings` when given.
RobotModel MakeRobot(const Robot& description, std::string_view urdf_xml,
                     std::vector<std::string>* warnings = nullptr);

/// Reads the Robot file and, relative to it, its URDF. Throws RobotError, one line that begins with
/// the file at fault.
RobotModel LoadRobotFiles(const std::string& robot_path,
                          std::vector<std::string>* warnings = nullptr);

/// The same from texts already read.
RobotModel LoadRobotTexts(std::string_view robot_text, std::string_view urdf_xml,
                          std::vector<std::string>* warnings = nullptr);

}  // namespace poise::robot
