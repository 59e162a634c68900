// Links to moving bodies: links fixed to each other merged, joints in depth-first order of the
// text.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "components/robot/robot_model.h"
#include "components/robot/robot_source.h"

namespace poise::robot {

struct LinkTree {
  struct LinkPlace {
    int body = -1;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< link frame in the body frame
  };
  std::string format;  ///< of the file, "URDF" or "MJCF"
  std::string name;
  std::string root_link;
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::map<std::string, LinkPlace> links;
  std::set<std::string> fixed_joints;  ///< locked ones among them
};

/// Throws RobotError naming link or joint: joints that move and are neither revolute nor
/// continuous, or mimic another, unless locked; missing or empty limits, zero axis, non-physical
/// inertia. Precondition: links and joints form one tree from `root`, names are unique.
LinkTree BuildLinkTree(const RobotSource& source);

/// Turns a body's frame about its origin: `facing` is the new frame in the old one. The robot stays
/// what it is.
void TurnBody(int body, const Eigen::Matrix3d& facing, LinkTree* tree);

}  // namespace poise::robot
