// What the elements of messages' arrays are called: joints, motors and feet by the robot's names.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/graph.pb.h"
#include "components/robot/robot_model.h"

namespace poise::logging {

/// "foot_wrench.force" of "foot_wrench[1].force[2]".
std::string WithoutIndexes(std::string_view path);

/// Names of the arrays that num_joints, num_motors and num_feet size, as the .lcm files declare
/// them. Immutable.
class ElementNames {
 public:
  /// No names: every path stays as it is.
  ElementNames() = default;
  /// Joints and motors in the order of the robot's joints, feet by the names in its file. A name
  /// that a path could not hold (".[]", spaces, digits alone, ...) is not used.
  explicit ElementNames(const robot::RobotModel& robot);
  /// The names of a run's robot; none when its texts cannot be read.
  static ElementNames OfTexts(std::string_view robot_text, std::string_view urdf_xml);
  static ElementNames OfSpec(const RunSpec& spec);

  /// By index; empty: `field` is no array of named elements.
  const std::vector<std::string>& Of(std::string_view type, std::string_view field) const;
  /// "torque[right_knee_pitch].x" of "torque[3].x"; a path that has a name already, or to which
  /// none belongs, as it is. A foot may also be called by its link.
  std::string Label(std::string_view type, std::string_view path) const;
  /// "right_knee_pitch", or "joint 3" without a name.
  std::string Joint(int index) const;

 private:
  /// Names by the count that sizes their array.
  std::map<std::string, std::vector<std::string>, std::less<>> names_;
  std::map<std::string, std::string, std::less<>> foot_of_link_;
};

}  // namespace poise::logging
