// What steps came to: of a push that was met by them, and of a walk, whoever made them.
#pragma once

#include <string>

#include "logging/run_record.h"

namespace poise {

/// True when the planner made a step of its own, or a foot made one that no planner planned: the
/// COM's reference then leads the COM or follows it, and the distance between the two is not how
/// far the COM went.
bool MadeSteps(const logging::RunRecord& run);

/// Sentences: of steps that caught a push when, why and where each foot came down, and how far the
/// COM went; of a walk its steps, way, speed and how well it kept its velocity. Empty without
/// steps.
std::string TellSteps(const logging::RunRecord& run);

}  // namespace poise
