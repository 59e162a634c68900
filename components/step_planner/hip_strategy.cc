#include "components/step_planner/hip_strategy.h"

namespace poise {
namespace {

// m beyond kStart that the capture point must be inside for kHoldTime until the body returns: a
// body that returned sooner would turn again.
constexpr double kInside = 0.02;
constexpr double kHoldTime = 0.2;  // s
// s that the return takes: twice the turn's, so that its reaction is a quarter of it.
constexpr double kReturnTime = 0.7;

}  // namespace

PointMotion HipStrategy::Update(const HipInput& input) {
  const double time = input.time;
  const PointMotion now = tilt_.At(time);
  const double excess = input.excess.norm();
  switch (state_) {
    case State::kUpright:
    case State::kReturning:
      if (excess > 0) {
        const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(input.excess) / excess;
        Enter(State::kTilting, time, now, kTilt * axis, kTiltTime);
      } else if (time >= since_ + kReturnTime) {
        state_ = State::kUpright;
      }
      break;
    case State::kTilting:
      if (input.near_joint_limit) {
        // The natural end of a quintic whose acceleration vanishes at both ends.
        const double time_left = kBrakeTime;
        Enter(State::kTilted, time, now, now.position + 0.5 * time_left * now.velocity, time_left);
      } else if (time >= since_ + kTiltTime) {
        state_ = State::kTilted;
        since_ = time;
      }
      break;
    case State::kTilted:
      if (input.margin < kInside) since_ = time;
      if (time >= since_ + kHoldTime) {
        Enter(State::kReturning, time, now, Eigen::Vector3d::Zero(), kReturnTime);
      }
      break;
  }
  return tilt_.At(time);
}

void HipStrategy::Enter(State state, double time, const PointMotion& from,
                        const Eigen::Vector3d& tilt, double duration) {
  state_ = state;
  since_ = time;
  tilt_.Begin(from, tilt, time, duration);
}

}  // namespace poise
