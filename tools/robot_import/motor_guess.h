// What drives each joint, where the maker's file does not say.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>

#include "components/robot/link_tree.h"
#include "components/robot_files/robot.pb.h"
#include "tools/robot_import/maker_file.h"

namespace poise {

struct MotorSources {
  bool effort_placeholder = false;                           ///< many joints have one torque limit
  bool friction = false, damping = false, armature = false;  ///< the file has some
};

/// Motors of all joints of the tree, equal ones together. `rotor`: kg·m² at the joint, those that
/// were hidden in links.
MotorSources AddMotors(const robot::LinkTree& tree, const MakerFile& maker,
                       const std::map<std::string, double>& rotor, Robot* robot);

/// Rated currents of motors whose joints bear `torque`, N·m by joint of the tree, on one foot: half
/// of the peak's, or what they bear with a reserve, the peak's at most. Nothing known of one foot:
/// the peak's, since a limit that nobody gave must not fell a robot.
void RateMotors(const robot::LinkTree& tree, const std::optional<Eigen::VectorXd>& torque,
                Robot* robot);

/// Gear compliance, lag and delay of motors of this torque (N·m, the largest of a leg's joint).
void AddDriveTrain(double torque, Robot* robot);

/// N·m for a joint without a limit: of a leg or the trunk, or of the rest.
double GuessedEffort(double mass, bool strong);
/// A limit that no motor has, N·m: a number that stands for none.
bool IsPlaceholderEffort(double effort, double mass, bool leg);
inline constexpr double kGuessedVelocity = 20;  ///< rad/s, of the joint of a humanoid's drive
/// rad/s: above it no servo drive's joint turns, and what is taken instead, the usual one.
inline constexpr double kMostVelocity = 40, kUsualVelocity = 15;

}  // namespace poise
