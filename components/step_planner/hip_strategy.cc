#include "components/step_planner/hip_strategy.h"

#include <cmath>
#include <string>

#include "components/framework/configuration/configuration.h"

namespace poise {

PointMotion HipStrategy::Update(const HipInput& input) {
  const double time = input.time;
  const PointMotion now = tilt_.At(time);
  const double excess = input.excess.norm();
  switch (state_) {
    case State::kUpright:
    case State::kReturning:
      if (excess > 0) {
        const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ().cross(input.excess) / excess;
        Enter(State::kTilting, time, now, config_.tilt() * axis, config_.tilt_time());
      } else if (time >= since_ + config_.return_time()) {
        state_ = State::kUpright;
      }
      break;
    case State::kTilting:
      if (input.near_joint_limit) {
        // The natural end of a quintic whose acceleration vanishes at both ends.
        const double time_left = config_.brake_time();
        Enter(State::kTilted, time, now, now.position + 0.5 * time_left * now.velocity, time_left);
      } else if (time >= since_ + config_.tilt_time()) {
        state_ = State::kTilted;
        since_ = time;
      }
      break;
    case State::kTilted:
      if (input.margin < config_.inside()) since_ = time;
      if (time >= since_ + config_.hold_time()) {
        Enter(State::kReturning, time, now, Eigen::Vector3d::Zero(), config_.return_time());
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

void CheckHipStrategyConfig(const HipStrategyConfig& config) {
  const auto check = [](bool holds, const char* name, const char* must) {
    if (!holds) throw ConfigError(std::string("hip_strategy.") + name, must);
  };
  const auto is_time = [&](double value, const char* name) {
    check(value > 0 && std::isfinite(value), name, "must be a time in s above 0");
  };
  check(config.tilt() >= 0 && config.tilt() <= 1.5, "tilt", "must be rad from 0 to 1.5");
  check(config.start() >= 0 && std::isfinite(config.start()), "start", "must be m, 0 or more");
  check(config.inside() >= 0 && std::isfinite(config.inside()), "inside", "must be m, 0 or more");
  check(config.joint_reserve() >= 0 && std::isfinite(config.joint_reserve()), "joint_reserve",
        "must be rad, 0 or more");
  is_time(config.tilt_time(), "tilt_time");
  is_time(config.hold_time(), "hold_time");
  is_time(config.return_time(), "return_time");
  is_time(config.brake_time(), "brake_time");
}

}  // namespace poise
