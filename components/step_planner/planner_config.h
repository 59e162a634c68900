// What a step planner's configuration must be like.
#pragma once

#include "components/balance/convex_polygon.h"
#include "components/robot/robot_model.h"
#include "components/step_planner/contact/landing.h"
#include "components/step_planner/step_planner.pb.h"

namespace poise {

/// Throws ConfigError naming the field ("phase[2].duration", "contact.release_load") of a plan
/// whose numbers keep their rules (CheckFields) and do not fit together.
void CheckStepPlannerConfig(const StepPlannerConfig& config);

/// m, sole frame: where on a foot the robot balances before the other one leaves the ground. Throws
/// ConfigError: stance_half_length or _width is not of this sole.
balance::ConvexPolygon StanceSole(const robot::FootModel& foot, const StepPlannerConfig& config);

/// How a foot of a phase comes down, which the steps of recovery and walk begin from.
LandingSpec MakeLandingSpec(const ContactConfirmation& config);

}  // namespace poise
