// RobotModel from a Robot text file and the URDF it names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "components/robot/robot_model.h"

namespace poise::robot {

/// Reads the Robot file and, relative to it, its URDF. Throws RobotError, one line that begins with
/// the file at fault.
RobotModel LoadRobotFiles(const std::string& robot_path,
                          std::vector<std::string>* warnings = nullptr);

/// The same from texts already read.
RobotModel LoadRobotTexts(std::string_view robot_text, std::string_view urdf_xml,
                          std::vector<std::string>* warnings = nullptr);

}  // namespace poise::robot
