// Sections 6.2 and 7.4: the ratio ramped to one foot before lift-off, and back after touch-down.
#pragma once

#include "components/robot/foot.h"

namespace poise::balance {

/// η during a transition: from `free_ratio` (progress 0) to the ratio that leaves `foot` without
/// load (progress 1) when unloading, the reverse when loading.
double TransitionRatio(double free_ratio, robot::Foot foot, bool unloading, double progress);

}  // namespace poise::balance
