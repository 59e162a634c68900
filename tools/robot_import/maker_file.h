// What a maker's file says of a robot, URDF or MJCF, with the SRDF beside it.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "components/robot/robot_source.h"
#include "components/robot_files/mjcf_source.h"

namespace poise {

struct MakerFile {
  std::filesystem::path path;
  std::string text;
  bool is_mjcf = false;
  robot::RobotSource source;
  std::vector<robot::SourceShape> shapes;
  /// kind: "imu", "gyro", "accelerometer", "force", "torque", "force_torque"; site: a link or a
  /// joint
  std::vector<robot::MjcfSensor> sensors;
  std::vector<robot::MjcfKey> postures;  ///< keyframes, group states of the SRDF
  std::string postures_from;             ///< "keyframe", or the SRDF's file name
  std::set<std::string> actuated;        ///< joints; empty: the file names no actuator
  Eigen::Quaterniond root_orientation = Eigen::Quaterniond::Identity();  ///< in the world
  std::string mesh_folder;                                               ///< as MJCF names it
  std::set<std::string> from_shapes;  ///< links whose mass is that of their shapes
  std::vector<std::string> left_out;  ///< a line each
};

/// `srdf` empty: a file of that ending beside `path`, the one of the same name first. Throws
/// ConfigError and robot::RobotError.
MakerFile ReadMakerFile(const std::filesystem::path& path, const std::filesystem::path& srdf);

}  // namespace poise
