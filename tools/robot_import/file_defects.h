// What is wrong with a maker's file, all of it at once, and the repairs.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/robot_import/maker_file.h"
#include "tools/robot_import/robot_import.h"

namespace poise {

/// Adds repairs, locks and limits to the robot's text, each with its defect, so that its tree can
/// be built; the same is done to `maker->source`. `lock`: joints that are to stand still besides.
/// `rotor` gets kg·m² by joint, of those found in links.
void RepairDefects(const std::vector<std::string>& lock, MakerFile* maker, RobotImport* result,
                   std::map<std::string, double>* rotor);

}  // namespace poise
