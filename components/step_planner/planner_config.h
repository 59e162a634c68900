// What a step planner's configuration must be like.
#pragma once

#include "components/balance/convex_polygon.h"
#include "components/robot/robot_model.h"
#include "components/step_planner/contact/landing.h"
#include "components/step_planner/step_planner.pb.h"

namespace poise {

/// Throws ConfigError naming the field ("phase[2].duration") of a plan whose numbers keep their
/// rules (CheckFields) and do not fit together.
void CheckStepPlannerConfig(const StepPlannerConfig& config);

/// m, sole frame: where on a foot the robot balances before the other one leaves the ground, the
/// COM at rest: the sole less 30 mm ahead and 25 mm sideways, or less 25 mm where it is no
/// rectangle, but at least half of it.
balance::ConvexPolygon StanceSole(const robot::FootModel& foot);

/// How a foot of a phase comes down, which the steps of recovery and walk begin from.
LandingSpec MakeLandingSpec(const ContactConfirmation& config);

}  // namespace poise
