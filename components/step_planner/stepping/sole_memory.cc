#include "components/step_planner/stepping/sole_memory.h"

#include <algorithm>

#include "components/robot/sole.h"

namespace poise::stepping {

SoleMemory::SoleMemory(const robot::FootModel& foot) {
  for (const Eigen::Vector2d& corner : robot::SoleCorners(foot)) corner_[num_corners_++] = corner;
}

double SoleMemory::Height(const Eigen::Isometry3d& sole, size_t corner) const {
  return sole.translation().z() + sole.linear().row(2).head<2>().dot(corner_[corner]);
}

void SoleMemory::Touch(const Eigen::Isometry3d& sole) {
  sinks_ = 0;
  for (size_t i = 0; i < num_corners_; ++i) height_[i] = Height(sole, i);
}

void SoleMemory::Expect(const Eigen::Isometry3d& sole, double load, double weight, double most) {
  sinks_ = std::min(ExpectedSinking(Sunk(sole), load, weight), most);
}

void SoleMemory::Correct(const Eigen::Isometry3d& sole, double load, double weight) {
  const double sunk = Sunk(sole);
  sinks_ = std::min(sinks_, std::max(sunk, ExpectedSinking(sunk, load, weight)));
}

double SoleMemory::Sunk(const Eigen::Isometry3d& sole) const {
  if (num_corners_ == 0) return 0;
  double least = height_[0] - Height(sole, 0);
  for (size_t i = 1; i < num_corners_; ++i) least = std::min(least, height_[i] - Height(sole, i));
  return std::max(least, 0.0);
}

double ExpectedSinking(double sunk, double load, double weight) {
  return load > 0 ? sunk * weight / load : 0;
}

}  // namespace poise::stepping
