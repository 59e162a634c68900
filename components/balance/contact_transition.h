// Sections 6.2 and 7.4: the ratio ramped to one foot before lift-off, and back after touch-down.
#pragma once

#include "components/balance/minimum_jerk.h"
#include "components/robot/foot.h"

namespace poise::balance {

/// η during a transition: from `free_ratio` (progress 0) to the ratio that leaves `foot` without
/// load (progress 1) when unloading, the reverse when loading.
inline double TransitionRatio(double free_ratio, robot::Foot foot, bool unloading,
                              double progress) {
  const double unloaded = foot == robot::Foot::kRight ? 0.0 : 1.0;
  const double share = SmoothStep(progress);
  // As a weighted sum the ratio is exact at both ends.
  return unloading ? free_ratio * (1 - share) + unloaded * share
                   : unloaded * (1 - share) + free_ratio * share;
}

}  // namespace poise::balance
