#include "sim_ode/push.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim_ode/config_check.h"

namespace poise {

using std::numbers::pi;

int FindBody(const robot::RobotModel& model, const std::string& name, const std::string& field) {
  std::string names;
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    if (model.bodies()[b].name == name) return static_cast<int>(b);
    names += (b == 0 ? "" : ", ") + model.bodies()[b].name;
  }
  throw ConfigError(field, "no moving link '" + name + "'; use one of " + names);
}

PushProfile::PushProfile(const Push& config, const robot::RobotModel& model,
                         const std::string& field)
    : start_(config.start()),
      duration_(config.duration()),
      peak_(config.peak()),
      profile_(config.profile()),
      direction_(config.direction_x(), config.direction_y(), config.direction_z()),
      point_(config.point().x(), config.point().y(), config.point().z()) {
  if (!config.has_start()) throw ConfigError(field + ".start", "missing; give it in s");
  if (!config.has_duration()) throw ConfigError(field + ".duration", "missing; give it in s");
  if (!config.has_peak()) throw ConfigError(field + ".peak", "missing; give it in N");
  RequireNotNegative(start_, field + ".start");
  RequirePositive(duration_, field + ".duration");
  RequireFinite(peak_, field + ".peak");
  if (!direction_.allFinite() || direction_.norm() < 1e-12) {
    throw ConfigError(field + ".direction_x", "no direction; set direction_x, _y or _z");
  }
  direction_.normalize();
  if (!point_.allFinite()) throw ConfigError(field + ".point", "must be finite");
  if (config.has_link()) body_ = FindBody(model, config.link(), field + ".link");
}

Eigen::Vector3d PushProfile::Force(double time) const {
  const double elapsed = time - start_;
  if (elapsed < 0 || elapsed >= duration_) return Eigen::Vector3d::Zero();
  const double shape = profile_ == Push::HALF_SINE ? std::sin(pi * elapsed / duration_) : 1.0;
  return peak_ * shape * direction_;
}

double PushProfile::Impulse(double time) const {
  const double elapsed = std::clamp(time - start_, 0.0, duration_);
  if (profile_ == Push::RECTANGLE) return peak_ * elapsed;
  return peak_ * duration_ / pi * (1 - std::cos(pi * elapsed / duration_));
}

Eigen::Vector3d PushProfile::MeanForce(double from, double to) const {
  return (Impulse(to) - Impulse(from)) / (to - from) * direction_;
}

}  // namespace poise
