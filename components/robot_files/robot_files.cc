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

RobotModel LoadRobotFiles(const std::string& robot_path, std::vector<std::string>* warnings) {
  const std::string text = ReadText(robot_path);
  Robot robot;
  try {
    robot = ParseRobot(text);
  } catch (const RobotError& error) {
    throw RobotError(robot_path + ":" + error.what());
  }
  const std::string maker_path = MakerFile(robot, robot_path);
  const std::string maker_text = ReadText(maker_path);
  try {
    return MakeRobot(robot, maker_text, warnings);
  } catch (const RobotError& error) {
    const std::string_view what = error.what();
    const bool of_maker = what.starts_with("URDF") || what.starts_with("MJCF");
    throw RobotError((of_maker ? maker_path : robot_path) + ": " + error.what());
  }
}

RobotModel LoadRobotTexts(std::string_view robot_text, std::string_view maker_text,
                          std::vector<std::string>* warnings) {
  return MakeRobot(ParseRobot(robot_text), maker_text, warnings);
}

}  // namespace poise::robot
