#include "sim/push.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/robot/dynamics.h"

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

double MeanOfPeak(Push::Profile profile) { return profile == Push::HALF_SINE ? 2 / pi : 1; }

double ImpulseScale(const robot::RobotModel& model, const robot::RobotState& start) {
  const robot::RobotData data = robot::Evaluate(model, start);
  double ground = data.foot_pose[0].translation().z();
  for (const Eigen::Isometry3d& sole : data.foot_pose) {
    ground = std::min(ground, sole.translation().z());
  }
  return model.total_mass() * std::sqrt(robot::kGravity * (data.com.z() - ground));
}

PushProfile::PushProfile(const Push& config, const robot::RobotModel& model, double impulse_scale,
                         const std::string& field)
    : start_(config.start()),
      duration_(config.duration()),
      peak_(config.peak()),
      profile_(config.profile()),
      direction_(config.direction_x(), config.direction_y(), config.direction_z()),
      point_(config.point().x(), config.point().y(), config.point().z()) {
  RequireFields(config, {"start", "duration"}, field + ".");
  if (config.has_peak() == config.has_scaled_impulse()) {
    throw ConfigError(field + ".peak", config.has_peak()
                                           ? "and scaled_impulse exclude each other; remove one"
                                           : "missing; give it in N, or scaled_impulse");
  }
  if (config.has_scaled_impulse()) {
    peak_ = config.scaled_impulse() * impulse_scale / (MeanOfPeak(profile_) * duration_);
  }
  if (direction_.norm() < 1e-12) {
    throw ConfigError(field + ".direction_x", "no direction; set direction_x, _y or _z");
  }
  if (!std::isfinite(direction_.norm())) {
    throw ConfigError(field + ".direction_x", "too long a direction; its length does not matter");
  }
  direction_.normalize();
  if (config.at_body()) {
    if (config.has_link() || config.has_point()) {
      throw ConfigError(field + ".at_body", "stands in place of link and point; remove them");
    }
    body_ = model.body_task_body();
    point_ = model.bodies()[static_cast<size_t>(body_)].com;
  }
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
