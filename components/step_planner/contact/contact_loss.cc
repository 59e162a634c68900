#include "components/step_planner/contact/contact_loss.h"

#include <algorithm>

namespace poise {

void ContactLoss::Update(double time, double load, bool carries, double deviation) {
  lost_ = empty_.Update(time, carries && load < std::max(release_load_, deviation), kLostDuration);
}

}  // namespace poise
