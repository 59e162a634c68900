// How much of a push steps could survive, from what physics allows down to what the planner does.
#pragma once

#include <Eigen/Core>

#include "components/robot/robot_model.h"
#include "components/step_planner/stepping/recovery.h"
#include "sim/push.h"

namespace poise {

/// A robot's steps without its legs' mass and its motors. It stands on both feet.
class StepLadder {
 public:
  /// Throws ConfigError where the robot's legs reach nothing, or its soles are too small.
  explicit StepLadder(const robot::RobotModel& model);

  /// N·s, the bound of N steps, of any number: m ω (r + Σ l_k e^{−ω t_k}). r is the way from the
  /// COM to the soles' edge, l_k that from the sole that stands to the farthest one that the foot
  /// whose turn it is reaches, both along the unit vector `direction`; t_k is k times the least
  /// swing and the first foot's unloading. The feet take turns, and the better one begins. Koolen,
  /// de Boer, Rebula, Goswami, Pratt: Capturability-based analysis and control of legged
  /// locomotion, part 1, IJRR 2012.
  double Bound(const Eigen::Vector2d& direction) const;
  /// Whether the planner's steps keep a point mass from falling (PointMass) for `duration`, s, with
  /// a push whose start is counted from its start.
  bool Survives(const PushProfile& push, double period, double duration) const;
  /// N·s, m √(g h).
  double impulse_scale() const;

 private:
  const robot::RobotModel& model_;
  stepping::Recovery recovery_;
};

}  // namespace poise
