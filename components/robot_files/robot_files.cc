#include "components/robot_files/robot_files.h"

#include <fmt/format.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/text_format.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace poise::robot {
namespace {

// Keeps the first complaint, lines and columns from 1.
class FirstError : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int line, int column, const std::string& message) override {
    if (text_.empty()) text_ = fmt::format("{}:{}: {}", line + 1, column + 1, message);
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

Robot ParseRobot(std::string_view text) {
  FirstError error;
  google::protobuf::TextFormat::Parser parser;
  parser.RecordErrorsTo(&error);
  Robot robot;
  if (!parser.ParseFromString(std::string(text), &robot)) {
    throw RobotError(error.text() + ": correct that line");
  }
  return robot;
}

std::string ReadText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  if (!file || !(text << file.rdbuf())) {
    throw RobotError(path + ": cannot be read or is empty: check the path and its permissions");
  }
  return std::move(text).str();
}

}  // namespace

RobotModel LoadRobotFiles(const std::string& robot_path, std::vector<std::string>* warnings) {
  const std::string text = ReadText(robot_path);
  Robot robot;
  try {
    robot = ParseRobot(text);
  } catch (const RobotError& error) {
    throw RobotError(robot_path + ":" + error.what());
  }
  if (robot.urdf().empty()) {
    throw RobotError(robot_path + ": urdf is missing: give the URDF's path relative to this file");
  }
  const std::string urdf_path =
      (std::filesystem::path(robot_path).parent_path() / robot.urdf()).string();
  const std::string urdf = ReadText(urdf_path);
  try {
    return MakeRobot(robot, urdf, warnings);
  } catch (const RobotError& error) {
    const bool of_urdf = std::string_view(error.what()).starts_with("URDF");
    throw RobotError((of_urdf ? urdf_path : robot_path) + ": " + error.what());
  }
}

RobotModel LoadRobotTexts(std::string_view robot_text, std::string_view urdf_xml,
                          std::vector<std::string>* warnings) {
  return MakeRobot(ParseRobot(robot_text), urdf_xml, warnings);
}

}  // namespace poise::robot
