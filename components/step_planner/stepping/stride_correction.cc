#include "components/step_planner/stepping/stride_correction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace poise::stepping {
namespace {

using Eigen::Vector3d;

// Share of what is missing that a step makes up for, and bounds of the factor: what is missing
// beyond it is no leg's reaction.
constexpr double kGain = 0.2, kLeast = 0.9, kMost = 1.4;
// m/s and rad/s, below which a share of the command is noise.
constexpr double kLeastCommand = 0.03;

Vector3d Parts(const WalkCommand& command) {
  return {command.velocity.x(), command.velocity.y(), command.turn_rate};
}

}  // namespace

void StrideCorrection::Land(double time, const Eigen::Vector2d& middle, double heading,
                            const WalkCommand& command) {
  const double turn = std::remainder(heading - heading_, 2 * M_PI);
  Step now{.command = Parts(command), .duration = time - time_};
  now.way << Eigen::Rotation2Dd(-heading_ - 0.5 * turn) * (middle - middle_), turn;
  if (count_ == 2 && now.command == last_.command) {
    const Vector3d missing = now.command - (last_.way + now.way) / (last_.duration + now.duration);
    for (int i = 0; i < 3; ++i) {
      if (std::abs(now.command[i]) < kLeastCommand) continue;
      factor_[i] = std::clamp(factor_[i] + kGain * missing[i] / now.command[i], kLeast, kMost);
    }
  }
  last_ = now;
  time_ = time;
  middle_ = middle;
  heading_ = heading;
  count_ = std::min(count_ + 1, 2);
}

WalkCommand StrideCorrection::Corrected(const WalkCommand& command) const {
  WalkCommand corrected = command;
  corrected.velocity = factor_.head<2>().cwiseProduct(command.velocity);
  corrected.turn_rate *= factor_.z();
  return corrected;
}

void StrideCorrection::Archive(StateArchive* archive) {
  archive->Show(last_.way, last_.command, last_.duration, time_, middle_, heading_, count_,
                factor_);
}

}  // namespace poise::stepping
