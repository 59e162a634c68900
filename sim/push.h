// An external push: a force profile at a point of a body.
#pragma once

#include <Eigen/Core>
#include <string>

#include "components/robot/robot_model.h"
#include "sim/sim.pb.h"

namespace poise {

class PushProfile {
 public:
  /// `impulse_scale`: N·s, see ImpulseScale. `field` is the configuration's path ("push[0]").
  /// Throws ConfigError: no such link, no direction, start, duration or peak missing or out of
  /// range.
  PushProfile(const Push& config, const robot::RobotModel& model, double impulse_scale,
              const std::string& field);

  /// N, world axes, at time `time` (s).
  Eigen::Vector3d Force(double time) const;
  /// N, world axes: mean over [from, to], so that the impulse is exact whatever the step.
  Eigen::Vector3d MeanForce(double from, double to) const;
  int body() const { return body_; }
  const Eigen::Vector3d& point() const { return point_; }  ///< m, body frame

 private:
  double Impulse(double time) const;  // N·s, given from the start until `time`

  double start_, duration_, peak_;
  Push::Profile profile_;
  Eigen::Vector3d direction_;
  int body_ = 0;
  Eigen::Vector3d point_;
};

/// Mean force over the peak of a push of this shape.
double MeanOfPeak(Push::Profile profile);

/// N·s, m √(g h) of a robot with mass m and its COM at height h above its lower sole: what
/// scaled_impulse is a share of.
double ImpulseScale(const robot::RobotModel& model, const robot::RobotState& start);

/// Index of the body with this name. Throws ConfigError naming the field and the bodies there are.
int FindBody(const robot::RobotModel& model, const std::string& name, const std::string& field);

}  // namespace poise
