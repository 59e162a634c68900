#include "sim/hand.h"

#include <fmt/format.h>

#include "components/balance/minimum_jerk.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "sim/push.h"

namespace poise {

using Eigen::Vector3d;

namespace {

constexpr double kEarly = 1e-9;  // s, rounding of a time that is a whole number of steps

}  // namespace

HandSpring::HandSpring(const Hand& config, const robot::RobotModel& model, double step,
                       const std::string& field)
    : start_(config.start()),
      move_duration_(config.move_duration()),
      release_(config.release()),
      stiffness_(config.stiffness()),
      damping_(config.damping()),
      max_force_(config.max_force()),
      offset_(config.x(), config.y(), config.z()),
      point_(config.point().x(), config.point().y(), config.point().z()) {
  RequireFields(config, {"start", "move_duration", "release"}, field + ".");
  if (release_ < start_ + move_duration_ - kEarly) {
    throw ConfigError(field + ".release", fmt::format("{} s is before the move ends at {} s",
                                                      release_, start_ + move_duration_));
  }
  if (config.has_link()) body_ = FindBody(model, config.link(), field + ".link");
  // The force is explicit in the step; a point of a link feels as little as a quarter of its mass.
  const double mass = model.bodies()[static_cast<size_t>(body_)].mass / 4;
  if (step * (damping_ + step * stiffness_) > mass) {
    throw ConfigError(field + ".stiffness",
                      fmt::format("spring and damper are too stiff for a link of {} kg with steps "
                                  "of {} s; lower damping or stiffness",
                                  4 * mass, step));
  }
}

void HandSpring::Grip(double time, const Vector3d& position) {
  if (gripped_ || time < start_ - kEarly) return;
  gripped_ = true;
  origin_ = position;
}

Vector3d HandSpring::Force(double time, const Vector3d& position, const Vector3d& velocity) const {
  if (!gripped_ || time >= release_ - kEarly) return Vector3d::Zero();
  const balance::MinimumJerk move(time - start_, move_duration_);
  const Vector3d force = stiffness_ * (origin_ + move.position * offset_ - position) +
                         damping_ * (move.speed * offset_ - velocity);
  const double size = force.norm();
  return size > max_force_ ? Vector3d(max_force_ / size * force) : force;
}

}  // namespace poise
