#include "sim/crane.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "components/balance/minimum_jerk.h"
#include "components/framework/configuration/configuration.h"
#include "components/robot/dynamics.h"

namespace poise {

using Eigen::Vector3d;

namespace {

// The robot's weight stretches the spring by this. It is little beside the robot, which so starts
// where it is to stand, and leaves the spring soft beside its legs.
constexpr double kSag = 0.01;  // m
constexpr double kDampingRatio = 0.7;
// The force is explicit in the step; a point of a link feels as little as a quarter of its mass.
constexpr double kFeltMass = 0.25;
constexpr double kStable = 0.5;      // of the greatest damping that a step allows
constexpr double kTakeUpTime = 0.1;  // s, in which the hold comes back

}  // namespace

CraneSpring::CraneSpring(const Crane& config, const robot::RobotModel& model,
                         const Eigen::Isometry3d& base, const Vector3d& com, double step,
                         double tick_period)
    : release_time_(config.release_time()),
      tick_period_(tick_period),
      anchor_(com + config.height() * Vector3d::UnitZ()) {
  const double ticks = std::ceil(config.follow_time() / tick_period - 1e-9);
  follow_ticks_ = static_cast<int64_t>(std::min(ticks, 1e9));
  const double mass = model.total_mass();
  stiffness_ = config.has_stiffness() ? config.stiffness() : mass * robot::kGravity / kSag;
  const double felt = kFeltMass * model.bodies()[0].mass;
  damping_ = config.has_damping() ? config.damping()
                                  : std::min(2 * kDampingRatio * std::sqrt(mass * stiffness_),
                                             kStable * felt / step);
  if (step * (damping_ + step * stiffness_) > felt) {
    throw ConfigError(
        config.has_damping() ? "crane.damping" : "crane.stiffness",
        fmt::format("spring and damper are too stiff for a root link of {} kg with steps of {} s; "
                    "lower damping or stiffness",
                    model.bodies()[0].mass, step));
  }
  point_ = base.inverse() * anchor_;
}

void CraneSpring::Follow(bool follows) {
  if (let_go()) return;
  followed_ = follows ? followed_ + 1 : 0;
  if (!follows) {
    released_ = std::max(0.0, released_ - tick_period_ / kTakeUpTime);
  } else if (followed_ > follow_ticks_) {
    released_ = std::min(1.0, released_ + tick_period_ / release_time_);
  }
  share_ = 1 - balance::MinimumJerk(released_, 1).position;
}

Vector3d CraneSpring::Force(const Vector3d& position, const Vector3d& velocity) const {
  return share_ * (stiffness_ * (anchor_ - position) - damping_ * velocity);
}

}  // namespace poise
