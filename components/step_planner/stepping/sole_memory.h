// What a sole has told of the ground under it since it touched.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "components/framework/state_archive.h"
#include "components/robot/robot_model.h"

namespace poise::stepping {

/// m, that ground gives way by under `weight` where it has by `sunk`, m, under `load`; both in N,
/// of a linear spring. 0 without a load.
double ExpectedSinking(double sunk, double load, double weight);

/// Where a sole met the ground, and how far the ground gives way. Pure function of its calls; never
/// allocates once it is made.
class SoleMemory {
 public:
  SoleMemory() = default;
  explicit SoleMemory(const robot::FootModel& foot);

  /// `sole`, m, world, as it touches ground that is not known to give way.
  void Touch(const Eigen::Isometry3d& sole);
  /// m, 0 or more, by which it has gone into the ground since: its corner that went least. A sole
  /// that only lies down on tilted ground turns about the corner that touched first.
  double Sunk(const Eigen::Isometry3d& sole) const;
  /// The ground will give way under `weight`, N, as it has under `load`, N, by `most`, m, at most.
  void Expect(const Eigen::Isometry3d& sole, double load, double weight, double most);
  /// The same, never more than so far: a sole that stands on one corner sinks farther than one that
  /// lies, under the same load, so that each tick's is an upper bound.
  void Correct(const Eigen::Isometry3d& sole, double load, double weight);
  double sinks() const { return sinks_; }  ///< m, expected under the whole weight
  void Archive(StateArchive* archive) { archive->Show(height_, sinks_); }

 private:
  double Height(const Eigen::Isometry3d& sole, size_t corner) const;

  std::array<Eigen::Vector2d, robot::kMaxSoleVertices> corner_;  // m, sole frame
  size_t num_corners_ = 0;
  std::array<double, robot::kMaxSoleVertices> height_{};  // m, world, at the touch
  double sinks_ = 0;                                      // m
};

}  // namespace poise::stepping
