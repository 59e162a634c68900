// What a robot's legs cannot do, whatever else is configured.
#pragma once

#include <string>

#include "components/robot/robot_model.h"
#include "components/step_planner/stepping/reach.h"

namespace poise {

/// m sideways between the soles' centres with which the robot still stands, its COM in the middle.
double WidestStance(const stepping::Reach& reach);
/// The same with the COM above either sole, as when the other foot is in the air.
double WidestSpacing(const stepping::Reach& reach);
/// m that a sole can come down ahead of the other one, `spacing` (m) beside it, the COM in the
/// middle.
double LongestStride(const stepping::Reach& reach, double spacing);

/// Throw ConfigError "`part`.gap", "`part`.clearance" with the greatest value that the legs allow.
/// `reach`: with that gap.
void CheckGap(const std::string& part, double gap, const robot::RobotModel& model,
              const stepping::Reach& reach);
/// `clearance`: m by which either foot is raised, the COM as high as standing.
void CheckClearance(const std::string& part, double clearance, const robot::RobotModel& model);

}  // namespace poise
