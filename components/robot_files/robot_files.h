// RobotModel from a Robot text file and the maker's file, URDF or MJCF, that it names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "components/robot/link_tree.h"
#include "components/robot/robot_model.h"
#include "components/robot_files/robot.pb.h"

namespace poise::robot {

/// `maker_text` is MJCF where the description has `mjcf`, else URDF. Throws RobotError: unreadable
/// file, closed loop, no such link or joint, non-physical inertia, a joint type that cannot be
/// controlled, a joint without motor, not exactly two feet, fewer than six joints from base to a
/// foot. Visual and collision elements are not looked at, so no mesh is ever missed. Warnings go to
/// `warnings` when given.
RobotModel MakeRobot(const Robot& description, std::string_view maker_text,
                     std::vector<std::string>* warnings = nullptr);

/// The first half of it: the maker's links merged to bodies, after the description's repairs,
/// locks, limits and facings. Throws RobotError.
LinkTree MakeTree(const Robot& description, std::string_view maker_text,
                  std::vector<std::string>* warnings = nullptr);

/// A robot's files as they are on disk.
struct RobotFiles {
  std::string file, text;
  Robot description;                   ///< what the text says
  std::string maker_file, maker_text;  ///< URDF or MJCF, which the description names

  /// Throws RobotError, one line that begins with the file at fault.
  RobotModel Model(std::vector<std::string>* warnings = nullptr) const;
};

/// Reads both. Throws RobotError, one line that begins with the file at fault: it cannot be read, or
/// names no maker's file, two, or one that is not there, and then says where to get it and where to
/// put it.
RobotFiles ReadRobotFiles(const std::string& robot_path);

/// The model of ReadRobotFiles. Throws as that and RobotFiles::Model do.
RobotModel LoadRobotFiles(const std::string& robot_path,
                          std::vector<std::string>* warnings = nullptr);

/// The same from texts already read.
RobotModel LoadRobotTexts(std::string_view robot_text, std::string_view maker_text,
                          std::vector<std::string>* warnings = nullptr);

}  // namespace poise::robot
