// How far a sole sinks into the ground, from what presses it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "components/framework/state_archive.h"
#include "components/robot/robot_model.h"

namespace poise::stepping {

/// A sole since it touched. Pure function of its calls; never allocates once it is made.
class PressedSole {
 public:
  PressedSole() = default;
  explicit PressedSole(const robot::FootModel& foot);

  /// `sole`, m, world, as it touches.
  void Touch(const Eigen::Isometry3d& sole);
  /// m, 0 or more, by which it has gone into the ground since: its corner that went least. A sole
  /// that only lies down on tilted ground turns about the corner that touched first.
  double Sunk(const Eigen::Isometry3d& sole) const;
  void Archive(StateArchive* archive) { archive->Show(height_); }

 private:
  double Height(const Eigen::Isometry3d& sole, size_t corner) const;

  std::array<Eigen::Vector2d, robot::kMaxSoleVertices> corner_;  // m, sole frame
  size_t num_corners_ = 0;
  std::array<double, robot::kMaxSoleVertices> height_{};  // m, world, at the touch
};

/// m, that ground gives way by under `weight` where it has by `sunk`, m, under `load`; both in N,
/// of a linear spring. 0 without a load.
double ExpectedSinking(double sunk, double load, double weight);

}  // namespace poise::stepping
