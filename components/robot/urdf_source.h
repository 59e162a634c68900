// URDF text to links and joints.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "components/robot/robot_source.h"

namespace poise::robot {

/// Throws RobotError with line and element: everything ParseUrdf refuses, and origins that are not
/// finite. What can be repaired is not checked here.
RobotSource ReadUrdf(std::string_view xml, std::vector<std::string>* warnings);

}  // namespace poise::robot
