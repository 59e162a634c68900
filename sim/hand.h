// A person's hand on a link: a spring to a moving target.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

#include "components/robot/robot_model.h"
#include "sim/sim.pb.h"

namespace poise {

/// F = k (target - point) + d (target' - point'), no longer than max_force, from start to release.
class HandSpring {
 public:
  /// `field` is the configuration's path ("hand[0]"), `step` the world's (s). Throws ConfigError:
  /// no such link, times missing or out of order, a spring too stiff for the step.
  HandSpring(const Hand& config, const robot::RobotModel& model, double step,
             const std::string& field);

  /// Grips once `time` (s) has reached the start: the target's origin is where the point is now.
  void Grip(double time, const Eigen::Vector3d& position);
  /// N, world axes, on the point at `position` (m, world) moving with `velocity` (m/s).
  Eigen::Vector3d Force(double time, const Eigen::Vector3d& position,
                        const Eigen::Vector3d& velocity) const;
  int body() const { return body_; }
  const Eigen::Vector3d& point() const { return point_; }  ///< m, body frame

 private:
  double start_, move_duration_, release_, stiffness_, damping_, max_force_;
  Eigen::Vector3d offset_, point_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  int body_ = 0;
  bool gripped_ = false;
};

}  // namespace poise
