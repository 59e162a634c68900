// What the parts of an import have in common: names without case, numbers without noise.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "components/robot_files/robot.pb.h"

namespace poise {

/// Makes ASCII letters small.
std::string Lower(std::string text);
/// Whether `text` has `word`, which is in small letters, in letters of any kind.
bool Contains(const std::string& text, const char* word);

/// Rounds to six decimals (a micrometre), and never to -0.
double Clean(double value);
/// Sets the fields that are not zero.
void SetPose(const Eigen::Isometry3d& pose, Pose* result);

}  // namespace poise
