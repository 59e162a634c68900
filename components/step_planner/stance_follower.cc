#include "components/step_planner/stance_follower.h"

#include <algorithm>

namespace poise {
namespace {

// s for which both feet must carry: a foot that comes down bounces, or is put down elsewhere again.
constexpr double kCarryTime = 0.1;
// Share of the distance that is left as it is. More would be an error that stays, less noise.
constexpr double kRest = 0.2;

}  // namespace

Eigen::Vector3d StanceFollower::Update(double time, const Stance& stance) {
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  if (!stance.planned || distance_ == 0) {
    known_ = following_ = carried_ = false;
    return none;
  }
  if (!known_) {
    known_ = true;
    sole_ = stance.sole;
  }
  if (!stance.carried || !carried_) since_ = time;
  carried_ = stance.carried;
  const Eigen::Vector3d line = sole_[1] - sole_[0];
  const double share =
      std::clamp((stance.com - sole_[0]).dot(line) / std::max(line.squaredNorm(), 1e-12), 0.0, 1.0);
  Eigen::Vector3d way =
      (1 - share) * (stance.sole[0] - sole_[0]) + share * (stance.sole[1] - sole_[1]);
  way.z() = 0;
  const bool settled = carried_ && time - since_ >= kCarryTime && stance.resting;
  if (!settled || !way.allFinite()) return none;
  following_ = way.norm() > (following_ ? kRest : 1) * distance_;
  if (!following_) return none;
  sole_ = stance.sole;
  return way;
}

}  // namespace poise
