#include "tests/robot_import/import_support.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace poise {
namespace {

namespace fs = std::filesystem;

std::string Link(const std::string& name, double mass, const std::string& com, double ixx,
                 double iyy, double izz, const std::string& more = "") {
  return fmt::format(
      "<link name='{}'><inertial><origin xyz='{}'/><mass value='{}'/><inertia ixx='{}' ixy='0' "
      "ixz='0' "
      "iyy='{}' iyz='0' izz='{}'/></inertial>{}</link>\n",
      name, com, mass, ixx, iyy, izz, more);
}

std::string Joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& at, const std::string& axis, double lower, double upper) {
  return fmt::format(
      "<joint name='{}' type='revolute'><parent link='{}'/><child link='{}'/><origin xyz='{}'/>"
      "<axis xyz='{}'/><limit lower='{}' upper='{}' effort='100' velocity='10'/></joint>\n",
      name, parent, child, at, axis, lower, upper);
}

}  // namespace

std::string SimpleBiped(const Biped& changes) {
  std::string text = "<robot name='biped'>\n";
  if (!changes.base_rpy.empty()) {
    text +=
        "<link name='root'/><joint name='turn' type='fixed'><parent link='root'/><child "
        "link='base'/><origin rpy='" +
        changes.base_rpy + "'/></joint>\n";
  }
  text += Link("base", 20, "0 0 0.1", 0.3, 0.25, 0.2);
  for (const auto& [side, y] : {std::pair{"left", 0.1}, std::pair{"right", -0.1}}) {
    const std::string s = side;
    const std::string foot = changes.ankle_roll ? "_foot" : "_ankle";
    text += Link(s + "_hip_yaw", 1, "0 0 0", 0.002, 0.002, 0.002);
    text += Link(s + "_hip_roll", 1, "0 0 0", 0.002, 0.002, 0.002);
    text += Link(s + "_thigh", 4, "0 0 -0.2", 0.05, 0.05, 0.01);
    text += Link(s + "_shin", 3, "0 0 -0.2", kShinInertia[0], kShinInertia[1] + changes.shin_rotor,
                 kShinInertia[2]);
    const std::string box =
        "<collision><origin xyz='0.06 0 -0.07'/><geometry><box size='0.24 0.1 0.02'/></geometry>"
        "</collision>";
    if (changes.ankle_roll) text += Link(s + "_ankle", 0.5, "0 0 0", 0.001, 0.001, 0.001);
    text += Link(s + foot, 1, "0.03 0 -0.05", 0.002, 0.004, 0.005, box);
    text += Joint(s + "_hip_yaw_joint", "base", s + "_hip_yaw", fmt::format("0 {} -0.1", y),
                  "0 0 1", -0.6, 0.6);
    text +=
        Joint(s + "_hip_roll_joint", s + "_hip_yaw", s + "_hip_roll", "0 0 0", "1 0 0", -0.5, 0.5);
    text += Joint(s + "_hip_pitch_joint", s + "_hip_roll", s + "_thigh", "0 0 0", "0 1 0", -2, 1);
    text += Joint(s + "_knee_joint", s + "_thigh", s + "_shin", "0 0 -0.4", "0 1 0", 0, 2.2);
    text +=
        Joint(s + "_ankle_pitch_joint", s + "_shin", s + "_ankle", "0 0 -0.4", "0 1 0", -1.2, 0.8);
    if (changes.ankle_roll) {
      text +=
          Joint(s + "_ankle_roll_joint", s + "_ankle", s + "_foot", "0 0 0", "1 0 0", -0.5, 0.5);
    }
  }
  return text + changes.more_links + "</robot>\n";
}

namespace {

/// The folder is this process's and goes with it.
class MakersTemporaryFolder {
 public:
  MakersTemporaryFolder()
      : path_(fs::path(testing::TempDir()) / fmt::format("poise_import_{}", getpid())) {}
  ~MakersTemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

fs::path WriteMaker(const std::string& name, const std::string& text) {
  static const MakersTemporaryFolder temporary;
  const fs::path folder = temporary.path() / name;
  fs::create_directories(folder);
  const fs::path file = folder / (name + (text.find("<mujoco") < 200 ? ".xml" : ".urdf"));
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

RobotImport ImportText(const std::string& name, const std::string& text) {
  ImportOptions options;
  options.file = WriteMaker(name, text);
  return ImportRobot(options);
}

std::string Refusal(const ImportOptions& options) {
  try {
    ImportRobot(options);
    return "taken";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

std::string RefusalOf(const std::string& text) {
  ImportOptions options;
  options.file = WriteMaker("refused", text);
  return Refusal(options);
}

const Motor& MotorOf(const Robot& robot, const std::string& joint) {
  for (const Motor& motor : robot.motor()) {
    if (std::ranges::find(motor.joint(), joint) != motor.joint().end()) return motor;
  }
  throw std::runtime_error("no motor of " + joint);
}

fs::path MakersFolder() {
  const char* const told = std::getenv("POISE_ROBOTS");
  const fs::path folder =
      told != nullptr ? fs::path(told) : fs::path(POISE_SOURCE_DIR) / "../shared/robots";
  std::error_code error;
  return fs::is_directory(folder, error) ? folder : fs::path();
}

}  // namespace poise
