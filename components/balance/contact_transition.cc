#include "components/balance/contact_transition.h"

#include "components/balance/minimum_jerk.h"

namespace poise::balance {

double TransitionRatio(double free_ratio, robot::Foot foot, bool unloading, double progress) {
  const double unloaded = foot == robot::Foot::kRight ? 0.0 : 1.0;
  const double share = SmoothStep(progress);
  // As a weighted sum the ratio is exact at both ends.
  return unloading ? free_ratio * (1 - share) + unloaded * share
                   : unloaded * (1 - share) + free_ratio * share;
}

}  // namespace poise::balance
