// URDF to moving bodies: links fixed to each other merged, joints in depth-first order of the text.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "components/robot/robot_model.h"

namespace poise::robot {

struct UrdfTree {
  struct LinkPlace {
    int body = -1;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< link frame in the body frame
  };
  std::string name;
  std::string root_link;
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::map<std::string, LinkPlace> links;
  std::set<std::string> fixed_joints;
};

/// Throws RobotError naming link or joint: everything ParseUrdf refuses, joint types other than
/// revolute, continuous and fixed, missing or empty limits, zero axis, non-physical inertia.
UrdfTree LoadUrdfTree(std::string_view xml, std::vector<std::string>* warnings);

}  // namespace poise::robot
