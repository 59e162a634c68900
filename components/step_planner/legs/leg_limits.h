// What a robot's legs cannot do, whatever else is configured.
#pragma once

#include "components/robot/robot_model.h"
#include "components/step_planner/legs/reach.h"

namespace poise {

/// m sideways between the soles' centres with which the robot still stands, its COM in the middle.
double WidestStance(const stepping::Reach& reach);
/// m beside the COM at which either foot can come down, as when the other one stands below the COM.
double WidestSpacing(const stepping::Reach& reach);
/// m that a sole can come down ahead of the other one, `spacing` (m) beside it, the COM in the
/// middle.
double LongestStride(const stepping::Reach& reach, double spacing);

/// m, at most `wanted`, by which the COM can be lower than standing while either leg alone holds
/// the robot with 0.6 of its joints' torque: a step takes the rest.
double MostLowering(const robot::RobotModel& model, double wanted);

/// Throw ConfigError "walk.gap", "walk.clearance" with the greatest value that the legs allow.
/// `reach`: with that gap.
void CheckGap(double gap, const robot::RobotModel& model, const stepping::Reach& reach);
/// Throws ConfigError "walk.quasi_static" with the joints that keep either sole from standing
/// within `distance` m of right below the COM. `reach`: at `height` m.
void CheckStanceLegs(double distance, const robot::RobotModel& model, const stepping::Reach& reach,
                     double height);
/// `clearance`: m by which either foot is raised, the COM as high as standing.
void CheckClearance(double clearance, const robot::RobotModel& model);

}  // namespace poise
