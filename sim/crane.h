// The crane that holds the robot until it is controlled.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "components/robot/robot_model.h"
#include "sim/sim.pb.h"

namespace poise {

/// A spring and a damper between a point of the root link and that point's place at the start.
/// Never allocates or throws after construction.
class CraneSpring {
 public:
  /// `base`: pose of the root link and `com`: m, both in the world at the start. `step`: s, of the
  /// simulation; `tick_period`: s. Throws ConfigError.
  CraneSpring(const Crane& config, const robot::RobotModel& model, const Eigen::Isometry3d& base,
              const Eigen::Vector3d& com, double step, double tick_period);

  /// Once a tick: whether the bridge follows commands. After follow_time of that the hold fades in
  /// release_time; when the bridge stops following before it has let go, the hold comes back.
  void Follow(bool follows);

  /// N, world, on the robot at the point, which is at `position` (m) with `velocity` (m/s).
  Eigen::Vector3d Force(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity) const;

  const Eigen::Vector3d& point() const { return point_; }    ///< m, root link's frame
  const Eigen::Vector3d& anchor() const { return anchor_; }  ///< m, world
  double share() const { return share_; }         ///< of its stiffness: 1 holds, 0 let go
  bool let_go() const { return released_ >= 1; }  ///< for good
  /// s, so far, without a break.
  double followed() const { return static_cast<double>(followed_) * tick_period_; }
  double stiffness() const { return stiffness_; }  ///< N/m
  double damping() const { return damping_; }      ///< N·s/m

 private:
  double stiffness_, damping_, release_time_, tick_period_;
  int64_t follow_ticks_;
  Eigen::Vector3d point_, anchor_;
  int64_t followed_ = 0;  // ticks
  double released_ = 0;   // share of the release that is over
  double share_ = 1;
};

}  // namespace poise
