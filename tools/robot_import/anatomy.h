// Which links of a robot are feet, which is the right one, and where is forward.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "components/robot/link_tree.h"

namespace poise {

/// How much a guess is to be trusted.
enum class Sureness { kSure, kLikely, kGuess };
const char* SurenessName(Sureness sureness);

struct Leg {
  int body = -1;            ///< of the foot
  std::vector<int> joints;  ///< from where the legs part to the foot
};

struct Anatomy {
  robot::FootArray<Leg> leg;
  int hips = 0;  ///< body where they part: the root, or one below a waist
  /// In the root link: x forward, y left, z up.
  Eigen::Matrix3d facing = Eigen::Matrix3d::Identity();
  Sureness sides = Sureness::kGuess, forward = Sureness::kGuess;
  std::string sides_from, forward_from;
};

/// m, root link: pose of each body with these joints.
std::vector<Eigen::Isometry3d> BodyPoses(const robot::LinkTree& tree,
                                         const Eigen::VectorXd& joint_position);

/// Legs are the two branches that reach lowest and part above more joints than lie above them.
/// `up` is a unit vector of the root link, `low` how far each body reaches below its frame's origin
/// along -up in `poses` (m), `feet` two links to be taken instead, or empty ones. `locked` says of
/// a link which of the file's joints on the way to it stand still, or nothing: a leg that lacks
/// joints is told with them. Throws robot::RobotError: no two legs, or fewer than six joints in
/// one, by name.
Anatomy FindAnatomy(const robot::LinkTree& tree, const std::vector<Eigen::Isometry3d>& poses,
                    const Eigen::Vector3d& up, const std::vector<double>& low,
                    const std::array<std::string, 2>& feet,
                    const std::function<std::string(const std::string&)>& locked);

/// -1: the name speaks of the right side, 1: of the left, 0: of none.
int SideOfName(const std::string& name);

}  // namespace poise
