#include "logging/element_names.h"

#include <algorithm>
#include <charconv>

#include "components/framework/run.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "lcmtypes/field_table.h"

namespace poise::logging {
namespace {

constexpr char kJoints[] = "num_joints";
constexpr char kMotors[] = "num_motors";
constexpr char kFeet[] = "num_feet";

/// True for a name that stands for itself within a path, in a CSV file and in a shell's word.
bool FitsAPath(std::string_view name) {
  const auto plain = [](unsigned char c) {
    return c > 0x7f ||
           (c > ' ' && std::string_view(".[]\"',;=*?\\`$\x7f").find(static_cast<char>(c)) ==
                           std::string_view::npos);
  };
  return std::all_of(name.begin(), name.end(), plain) &&
         name.find_first_not_of("-0123456789") != std::string_view::npos;
}

/// The names, or none when one of them is no name or two are the same.
std::vector<std::string> IfUsable(std::vector<std::string> names) {
  std::vector<std::string> sorted = names;
  std::sort(sorted.begin(), sorted.end());
  const bool unique = std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  if (!unique || !std::all_of(names.begin(), names.end(), FitsAPath)) names.clear();
  return names;
}

}  // namespace

std::string WithoutIndexes(std::string_view path) {
  std::string field;
  bool index = false;
  for (const char c : path) {
    index = index || c == '[';
    if (!index) field.push_back(c);
    index = index && c != ']';
  }
  return field;
}

ElementNames::ElementNames(const robot::RobotModel& robot) {
  std::vector<std::string> joints;
  for (const robot::Joint& joint : robot.joints()) joints.push_back(joint.name);
  names_[kJoints] = names_[kMotors] = IfUsable(std::move(joints));
  std::vector<std::string> feet;
  for (const robot::FootModel& foot : robot.feet()) {
    feet.push_back(foot.name);
    foot_of_link_[robot.bodies().at(static_cast<size_t>(foot.body)).name] = foot.name;
  }
  names_[kFeet] = IfUsable(std::move(feet));
}

ElementNames ElementNames::OfTexts(std::string_view robot_text, std::string_view urdf_xml) {
  try {
    return ElementNames(robot::LoadRobotTexts(robot_text, urdf_xml));
  } catch (const robot::RobotError&) {
    return {};
  }
}

ElementNames ElementNames::OfSpec(const RunSpec& spec) {
  return OfTexts(ResourceOf(spec, "robot").text(), ResourceOf(spec, "urdf").text());
}

const std::vector<std::string>& ElementNames::Of(std::string_view type,
                                                 std::string_view field) const {
  static const std::vector<std::string> none;
  const FieldInfo* const info = FirstField(type, field);
  if (info == nullptr) return none;
  const auto names = names_.find(std::string_view(info->count));
  return names != names_.end() ? names->second : none;
}

std::string ElementNames::Label(std::string_view type, std::string_view path) const {
  const size_t open = path.find('[');
  const size_t close = path.find(']');
  if (open == std::string_view::npos || close == std::string_view::npos || close < open ||
      path.find('.') < open) {
    return std::string(path);
  }
  const std::vector<std::string>& names = Of(type, path);
  const std::string_view element = path.substr(open + 1, close - open - 1);
  size_t index = 0;
  const auto [end, error] = std::from_chars(element.data(), element.data() + element.size(), index);
  std::string name(element);
  if (error == std::errc() && end == element.data() + element.size() && index < names.size() &&
      std::to_string(index) == element) {
    name = names[index];
  } else if (const auto foot = foot_of_link_.find(element);
             foot != foot_of_link_.end() &&
             std::find(names.begin(), names.end(), foot->second) != names.end()) {
    name = foot->second;
  }
  return fmt::format("{}[{}]{}", path.substr(0, open), name, path.substr(close + 1));
}

std::string ElementNames::Joint(int index) const {
  const auto names = names_.find(std::string_view(kJoints));
  if (index >= 0 && names != names_.end() && static_cast<size_t>(index) < names->second.size()) {
    return names->second[static_cast<size_t>(index)];
  }
  return fmt::format("joint {}", index);
}

}  // namespace poise::logging
