// What drives each joint, where the maker's file does not say.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "components/robot/link_tree.h"
#include "components/robot_files/robot.pb.h"
#include "tools/robot_import/maker_file.h"

namespace poise {

struct MotorSources {
  bool velocity_placeholder = false;  ///< all joints have one velocity that none could reach
  bool effort_placeholder = false;    ///< many joints have one torque limit
  bool friction = false, damping = false, armature = false;  ///< the file has some
};

/// Motors of all joints of the tree, equal ones together. `rotor`: kg·m² at the joint, those that
/// were hidden in links.
MotorSources AddMotors(const robot::LinkTree& tree, const MakerFile& maker,
                       const std::map<std::string, double>& rotor, Robot* robot);

/// Gear compliance, lag and delay of motors of this torque (N·m, the largest of a leg's joint).
void AddDriveTrain(double torque, Robot* robot);

/// N·m and rad/s for a joint without limits: of a leg, or of the rest.
double GuessedEffort(double mass, bool leg);
inline constexpr double kGuessedVelocity = 20;  ///< rad/s, of the joint of a humanoid's drive

}  // namespace poise
