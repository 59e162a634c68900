// MJCF text to links, joints and shapes.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "components/robot/robot_source.h"

namespace poise::robot {

struct MjcfSensor {
  std::string kind;  ///< "gyro", "accelerometer", "force", "torque", ...
  std::string site;
  double noise = 0;  ///< in the sensor's unit
};

/// A posture that the file names.
struct MjcfKey {
  std::string name;
  std::map<std::string, double> joint;  ///< rad
};

struct MjcfDocument {
  RobotSource source;  ///< bodies are links, and so are sites, fixed to theirs
  std::vector<SourceShape> shapes;
  std::vector<MjcfSensor> sensors;
  std::vector<MjcfKey> keys;
  std::set<std::string> actuated;     ///< joints that an actuator moves
  std::set<std::string> from_shapes;  ///< links whose mass is that of their shapes
  std::string mesh_folder;            ///< as the file names it
  /// How the robot's root body stands in the world.
  Eigen::Quaterniond root_orientation = Eigen::Quaterniond::Identity();
};

/// Reads the one robot of the file: the body with a free joint, or else the first with joints.
/// MuJoCo resolves defaults, angles and orientations; masses are the file's own numbers, whatever
/// they are. Meshes are not read. What is left out goes to `warnings`, by name. Throws RobotError
/// with line and element.
MjcfDocument ReadMjcf(std::string_view xml, std::vector<std::string>* warnings);

}  // namespace poise::robot
