#include "components/step_planner/contact/contact_loss.h"

#include <algorithm>

namespace poise {
namespace {

constexpr double kTimeTolerance = 1e-9;  // s, far below a tick, far above rounding

}  // namespace

void ContactLoss::Update(double time, double load, bool carries, double deviation) {
  if (!carries || !(load < std::max(release_load_, deviation))) return Reset();
  if (!below_) {
    below_ = true;
    since_ = time;
  }
  lost_ = time - since_ >= duration_ - kTimeTolerance;
}

}  // namespace poise
