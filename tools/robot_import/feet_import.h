// The soles and force sensors of a robot's feet, from its maker's file.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "components/robot/link_tree.h"
#include "tools/robot_import/anatomy.h"
#include "tools/robot_import/body_shapes.h"
#include "tools/robot_import/maker_file.h"
#include "tools/robot_import/robot_import.h"

namespace poise {

/// Adds both feet to the robot's text, right first, with what was found and what was wrong. `poses`
/// are of the tree's bodies in a posture in which the robot faces along x.
void AddFeet(const ImportOptions& options, const MakerFile& maker, const robot::LinkTree& tree,
             const std::vector<Eigen::Isometry3d>& poses, const Anatomy& anatomy,
             BodyShapes* shapes, RobotImport* result);

}  // namespace poise
