// What a step planner's configuration must be like.
#pragma once

#include "components/step_planner/step_planner.pb.h"

namespace poise {

/// Throws ConfigError naming the field ("phase[2].duration", "contact.touch_load") of a plan that
/// cannot work.
void CheckStepPlannerConfig(const StepPlannerConfig& config);

}  // namespace poise
