// The swing foot's way to a foothold that may still move.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "components/framework/state_archive.h"
#include "components/messages/motion.h"
#include "components/messages/quintic.h"

namespace poise::stepping {

struct SwingSpec {
  double clearance = 0;    ///< m above the foothold; a foot that begins higher rises by `rise`
  double touch_speed = 0;  ///< m/s, downward, with which it meets the ground
  double freeze = 0;       ///< s before the end, from when on the foothold stays
  double rise = 0;         ///< m above where it begins that the foot rises at least
  double across = 1;       ///< share of the time after which the foot is above its foothold
  double wait = 0;         ///< share in which it only rises, from rest; below `across`
};

/// How a way from `from` around a corner to `to` passes it: m, any axes.
struct Passing {
  double share = 0.5;                                  ///< of the time, at the corner
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< m, there, times the whole time
};
Passing PassCorner(const Eigen::Vector2d& from, const Eigen::Vector2d& corner,
                   const Eigen::Vector2d& to);
/// m: the greatest acceleration of that way, from rest to rest, times the square of its time.
double CornerAcceleration(const Eigen::Vector2d& from, const Eigen::Vector2d& corner,
                          const Eigen::Vector2d& to);

/// The motions of x and y.
using Horizontal = std::array<Quintic::Point, 2>;

/// Sole centre and turn of a foot from lift-off to the ground. The way is continuous in position,
/// velocity and acceleration whatever the foothold does: each new one begins from the motion so
/// far. After `end` it goes on downward with touch_speed, for the ground is not where it was
/// expected.
class Swing {
 public:
  /// From the motion `from`, turned by `rotation`, to rest (but for touch_speed) at `foothold`, m,
  /// world, `level` its sole's rotation there, at `end`, s.
  void Begin(const PointMotion& from, const Eigen::Matrix3d& rotation,
             const Eigen::Vector3d& foothold, const Eigen::Matrix3d& level, double time, double end,
             const SwingSpec& spec);
  /// Right after Begin: by way of `corner`, m, world, in x and y, where `across` is 1.
  void GoAround(const Eigen::Vector2d& corner);
  /// Another foothold, in x and y, and time; no effect within `freeze` of the end. Of a swing
  /// without `wait` and `across`.
  void Move(const Eigen::Vector2d& foothold, double time, double end);
  PointMotion At(double time) const;
  RotationMotion RotationAt(double time) const;
  bool around() const { return around_; }
  double end() const { return end_; }
  /// Share of the time that has passed, 0 to 1.
  double Progress(double time) const;
  bool frozen(double time) const { return time > end_ - spec_.freeze; }
  const Eigen::Vector3d& foothold() const { return foothold_; }
  void Archive(StateArchive* archive);

 private:
  void MoveEnd(double time, double end);
  /// Both pieces of a way around a corner, the first from the motion `from` at `time`.
  void Turn(const Horizontal& from, double time);
  /// Whether the corner lies behind.
  bool Past(double time) const { return around_ && time >= corner_time_; }

  SwingSpec spec_;
  std::array<Quintic, 2> way_;  // x and y, up to the corner where there is one
  std::array<Quintic, 2> after_;
  Quintic rise_, fall_;
  bool around_ = false;
  Eigen::Vector2d from_ = Eigen::Vector2d::Zero(), corner_ = Eigen::Vector2d::Zero();  // m
  double corner_time_ = 0;                                                             // s
  Eigen::Vector3d foothold_ = Eigen::Vector3d::Zero();

  double start_ = 0, apex_ = 0, end_ = 0;  // s
  double apex_height_ = 0;                 // m
  Eigen::Matrix3d from_rotation_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();  // rad, rotation vector to `level`
};

}  // namespace poise::stepping
