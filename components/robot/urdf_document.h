// URDF text to a parsed document: XML and urdfdom's own checks, with every complaint in the
// exception.
#pragma once

#include <urdf_world/types.h>

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "components/robot/robot_source.h"

namespace poise::robot {

struct UrdfDocument {
  urdf::ModelInterfaceSharedPtr model;
  std::vector<std::string>
      joint_order;  ///< joint names as they stand in the text (urdfdom sorts by name)
  std::map<std::string, Mimic> mimics;  ///< by joint
};

/// Throws RobotError with line and element: bad XML, links or joints named twice or never, two
/// parents, anything urdfdom refuses. Visual and collision elements are dropped unread. Prints
/// nothing.
UrdfDocument ParseUrdf(std::string_view xml, std::vector<std::string>* warnings);

}  // namespace poise::robot
