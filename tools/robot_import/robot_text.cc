#include <google/protobuf/text_format.h>

#include <string_view>

#include "fmt/format.h"
#include "tools/robot_import/robot_import.h"

namespace poise {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr size_t kColumns = 110;

/// The fields of a message on one line.
std::string OneLiner(const Message& message) {
  google::protobuf::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  printer.SetUseShortRepeatedPrimitives(false);
  std::string text;
  printer.PrintToString(message, &text);
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

/// "motor { joint: ... }", over as many lines as its names and numbers take.
std::string Block(const std::string& name, const Message& message) {
  const std::string line = OneLiner(message);
  if (name.size() + line.size() + 5 <= kColumns) return fmt::format("{} {{ {} }}\n", name, line);
  std::string text = name + " {\n", row = " ";
  // Rows break between fields: at a blank outside of quotes and braces, before a name.
  int depth = 0;
  bool quoted = false;
  std::string field;
  const auto flush = [&] {
    if (field.empty()) return;
    if (row.size() + field.size() + 1 > kColumns) {
      text += row + "\n";
      row = " ";
    }
    row += " " + field;
    field.clear();
  };
  for (size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && (i == 0 || line[i - 1] != '\\')) quoted = !quoted;
    if (!quoted && c == '{') ++depth;
    if (!quoted && c == '}') --depth;
    const bool after_value = c == ' ' && i > 0 && line[i - 1] != ':' && line[i - 1] != '{' &&
                             i + 1 < line.size() && line[i + 1] != '{';
    if (!quoted && depth == 0 && after_value) {
      flush();
    } else {
      field += c;
    }
  }
  flush();
  return text + row + "\n}\n";
}

std::string Heading(std::string_view text) { return fmt::format("\n# {}\n", text); }

/// What the findings of that name say, for a comment.
std::string Told(const RobotImport& imported, std::string_view what) {
  for (const Finding& finding : imported.findings) {
    if (finding.what == what) {
      return fmt::format("{} ({})", finding.from, SurenessName(finding.sureness));
    }
  }
  return "";
}

}  // namespace

std::string RobotText(const RobotImport& imported) {
  const Robot& robot = imported.robot;
  std::string text =
      "# proto-file: components/robot_files/robot.proto\n# proto-message: poise.Robot\n"
      "# Written by `poise robot import`: sure is what the maker's file says, a guess is worth a "
      "look.\n";
  const auto field = [&](const char* name, const std::string& value) {
    text += fmt::format("{}: \"{}\"\n", name, value);
  };
  field("name", robot.name());
  if (robot.has_urdf()) field("urdf", robot.urdf());
  if (robot.has_mjcf()) field("mjcf", robot.mjcf());
  if (robot.has_source()) field("source", robot.source());
  field("body_link", robot.body_link());
  if (robot.facing_size() > 0)
    text += Heading("Frames that do not face forward: " + Told(imported, "forward"));
  for (const Facing& facing : robot.facing()) text += Block("facing", facing);
  if (robot.repair_size() > 0) text += Heading("What the file says wrongly of masses");
  for (const Repair& repair : robot.repair()) text += Block("repair", repair);
  if (robot.lock_size() > 0) text += Heading("Joints that stand still");
  for (const Lock& lock : robot.lock()) text += Block("lock", lock);
  if (robot.limit_size() > 0) text += Heading("Limits that the file does not give: guesses");
  for (const JointLimit& limit : robot.limit()) text += Block("limit", limit);
  text += Heading("Soles: " + Told(imported, "right sole") +
                  "; force sensors: " + Told(imported, "right force sensor"));
  for (const Foot& foot : robot.foot()) text += Block("foot", foot);
  text += fmt::format("force_noise: {:g}\nmoment_noise: {:g}\n", robot.force_noise(),
                      robot.moment_noise());
  text += Heading("IMU: " + Told(imported, "IMU"));
  text += Block("imu", robot.imu());
  text += Heading("Motors: " + Told(imported, "motors") + "; rotors: " +
                  Told(imported, "rotor inertia") + "; friction: " + Told(imported, "friction"));
  for (const Motor& motor : robot.motor()) text += Block("motor", motor);
  text += Heading("Drive train: " + Told(imported, "drive train"));
  text += Block("drive_train", robot.drive_train());
  text += Heading("Stance: " + Told(imported, "stance"));
  text += Block("stance", robot.stance());
  return text;
}

}  // namespace poise
