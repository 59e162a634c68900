// The robot that steps are computed for: a point mass above massless legs, on level ground.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "components/balance/convex_polygon.h"
#include "components/robot/robot_model.h"
#include "components/step_planner/stepping/recovery.h"

namespace poise::stepping {

/// Obeys the pendulum's equations; its feet are where the swing says, and carry where the ground
/// is. So what it survives is what the planner itself catches, with nothing lost by legs and
/// motors.
class PointMass {
 public:
  /// Stands on both feet as the robot does, its soles' middle at the origin.
  PointMass(const robot::RobotModel& model, Recovery recovery);

  /// Stands on the right foot from now on, the left one `z` m up.
  void LiftLeft(double z);
  void Command(const WalkCommand& command) { command_ = command; }
  /// N·s, at once.
  void Push(const Eigen::Vector2d& impulse) { velocity_.head<2>() += impulse / mass_; }
  /// `period`, s, goes by under a horizontal push, N. False: no step is under way.
  bool Tick(double period, const Eigen::Vector2d& force = Eigen::Vector2d::Zero());
  /// m above which a foot in the air is not brought: the ground there.
  void set_ground(double height) { ground_ = height; }

  /// Its COM is farther from its soles than it is high.
  bool fallen() const;
  Eigen::Vector2d capture_point() const {
    return com_.head<2>() + velocity_.head<2>() / frequency();
  }
  double frequency() const { return std::sqrt(robot::kGravity / com_.z()); }  ///< 1/s
  /// Hull of the soles in contact, `margin` m off their edges.
  balance::ConvexPolygon Soles(double margin) const;
  const Eigen::Isometry3d& sole(Foot foot) const { return sole_[Index(foot)]; }
  const Eigen::Vector3d& com() const { return com_; }
  const Eigen::Vector3d& velocity() const { return velocity_; }
  double height() const { return height_; }  ///< m, of the COM as it stands
  double mass() const { return mass_; }      ///< kg
  double time() const { return time_; }      ///< s
  const Recovery& recovery() const { return recovery_; }
  Recovery& recovery() { return recovery_; }

 private:
  bool Loaded(Foot foot) const;

  FootArray<robot::FootModel> feet_;
  double mass_, height_, ground_ = 0, time_ = 0;
  Recovery recovery_;
  Eigen::Vector3d com_, velocity_ = Eigen::Vector3d::Zero();
  std::array<Eigen::Isometry3d, 2> sole_;
  FootArray<bool> in_contact_{true, true};
  WalkCommand command_;
};

}  // namespace poise::stepping
