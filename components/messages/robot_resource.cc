#include "components/messages/robot_resource.h"

#include "components/robot_files/robot_files.h"

namespace poise {

std::shared_ptr<const robot::RobotModel> LoadRobot(const ComponentContext& context) {
  const std::string& description = context.resource("robot");
  const std::string& urdf = context.resource("urdf");
  try {
    const auto load = [&] {
      return std::make_shared<robot::RobotModel>(robot::LoadRobotTexts(description, urdf));
    };
    return context.shared->Get<robot::RobotModel>("robot", load);
  } catch (const robot::RobotError& error) {
    throw ConfigError(std::string("robot: ") + error.what());
  }
}

MessageCounts JointAndFootCounts(const robot::RobotModel& model) {
  return {model.num_joints(), static_cast<int32_t>(model.feet().size())};
}

MessageCounts JointCounts(const robot::RobotModel& model) { return {model.num_joints()}; }

MessageCounts FootCounts(const robot::RobotModel& model) {
  return {static_cast<int32_t>(model.feet().size())};
}

}  // namespace poise
