#include "components/step_planner/stance_follower.h"

#include <algorithm>

namespace poise {
namespace {

using robot::Foot;

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
  const Eigen::Vector3d& right = sole_[Foot::kRight];
  const Eigen::Vector3d line = sole_[Foot::kLeft] - right;
  const double share =
      std::clamp((stance.com - right).dot(line) / std::max(line.squaredNorm(), 1e-12), 0.0, 1.0);
  Eigen::Vector3d way = (1 - share) * (stance.sole[Foot::kRight] - right) +
                        share * (stance.sole[Foot::kLeft] - sole_[Foot::kLeft]);
  way.z() = 0;
  const bool settled = carried_ && time - since_ >= kCarryTime && stance.resting;
  if (!settled || !way.allFinite()) return none;
  following_ = way.norm() > (following_ ? kRest : 1) * distance_;
  if (!following_) return none;
  sole_ = stance.sole;
  return way;
}

}  // namespace poise
