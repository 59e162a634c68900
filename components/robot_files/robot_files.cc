#include "components/robot_files/robot_files.h"

#include <fmt/format.h>

#include <filesystem>

#include "components/framework/configuration/configuration.h"

namespace poise::robot {
namespace {

/// The path of the maker's file, which the description names relative to its own.
std::string MakerFile(const Robot& description, const std::string& robot_path) {
  if (description.urdf().empty() == description.mjcf().empty()) {
    throw RobotError(robot_path + (description.urdf().empty()
                                       ? ": urdf is missing: give the path of the URDF, or as mjcf "
                                         "that of the MJCF file, relative to this file"
                                       : ": urdf and mjcf are both given: leave one out"));
  }
  const std::string& name = description.urdf().empty() ? description.mjcf() : description.urdf();
  const std::filesystem::path path = std::filesystem::path(robot_path).parent_path() / name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw RobotError(fmt::format(
        "{}: the maker's file '{}' is not there: put it at {}{}", robot_path, name, path.string(),
        description.source().empty() ? "" : "; it is to be had from " + description.source()));
  }
  return path.string();
}

}  // namespace

RobotFiles ReadRobotFiles(const std::string& robot_path) {
  RobotFiles files;
  files.file = robot_path;
  try {
    files.text = ReadFile(robot_path);
    ParseTextProto(files.text, robot_path, &files.description);
    files.maker_file = MakerFile(files.description, robot_path);
    files.maker_text = ReadFile(files.maker_file);
  } catch (const ConfigError& error) {
    throw RobotError(error.what());
  }
  return files;
}

RobotModel RobotFiles::Model(std::vector<std::string>* warnings) const {
  try {
    return MakeRobot(description, maker_text, warnings);
  } catch (const RobotError& error) {
    const std::string_view what = error.what();
    const bool of_maker = what.starts_with("URDF") || what.starts_with("MJCF");
    throw RobotError((of_maker ? maker_file : file) + ": " + error.what());
  }
}

RobotModel LoadRobotFiles(const std::string& robot_path, std::vector<std::string>* warnings) {
  return ReadRobotFiles(robot_path).Model(warnings);
}

RobotModel LoadRobotTexts(std::string_view robot_text, std::string_view maker_text,
                          std::vector<std::string>* warnings) {
  Robot robot;
  try {
    ParseTextProto(robot_text, "text", &robot);
  } catch (const ConfigError& error) {
    throw RobotError(error.what());
  }
  return MakeRobot(robot, maker_text, warnings);
}

}  // namespace poise::robot
