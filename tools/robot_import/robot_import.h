// From a maker's file to a Robot text: what was found, how sure it is, what was wrong with the
// file.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "components/robot_files/robot.pb.h"
#include "tools/robot_import/anatomy.h"

namespace poise {

/// What the command line says in place of a guess; empty: guess.
struct ImportOptions {
  std::filesystem::path file, srdf;
  std::vector<std::filesystem::path> meshes;  ///< folders
  std::string name;                           ///< of the robot
  std::array<std::string, 2> foot;            ///< links, right first
  std::string imu, body;                      ///< links
  std::vector<std::string> lock;              ///< joints
  std::string stance;                         ///< a keyframe's or group state's name
  std::optional<std::array<double, 2>> sole;  ///< m, length and width
};

struct Finding {
  std::string what, value, from;
  Sureness sureness = Sureness::kSure;
};

/// What the maker's file says wrongly, or cannot be used, and what was done about it.
struct Defect {
  std::string what, done;
};

struct RobotImport {
  Robot robot;
  std::vector<Finding> findings;
  std::vector<Defect> defects;
};

/// Throws ConfigError and robot::RobotError: a file that is none, or a robot that cannot balance,
/// by name. What comes back loads.
RobotImport ImportRobot(const ImportOptions& options);

/// The text of the Robot file, with comments that tell guesses.
std::string RobotText(const RobotImport& imported);

}  // namespace poise
