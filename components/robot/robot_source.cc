#include "components/robot/robot_source.h"

#include <algorithm>

namespace poise::robot {

SourceLink* RobotSource::FindLink(std::string_view link) {
  const auto found = std::ranges::find(links, link, &SourceLink::name);
  return found == links.end() ? nullptr : &*found;
}

SourceJoint* RobotSource::FindJoint(std::string_view joint) {
  const auto found = std::ranges::find(joints, joint, &SourceJoint::name);
  return found == joints.end() ? nullptr : &*found;
}

}  // namespace poise::robot
