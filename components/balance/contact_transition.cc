#include "components/balance/contact_transition.h"

namespace poise::balance {

double SmoothStep(double s) {
  if (!(s > 0)) return 0;  // NaN too
  if (s >= 1) return 1;
  return s * s * s * (10 + s * (-15 + 6 * s));
}

double TransitionRatio(double free_ratio, int foot, bool unloading, double progress) {
  const double unloaded = foot == 0 ? 0.0 : 1.0;
  const double share = SmoothStep(progress);
  // Both ends exact.
  return unloading ? free_ratio * (1 - share) + unloaded * share
                   : unloaded * (1 - share) + free_ratio * share;
}

}  // namespace poise::balance
