// What a walk's steps fall short of the command, made up for by longer ones.
#pragma once

#include <Eigen/Core>

#include "components/framework/state_archive.h"
#include "components/step_planner/stepping/footsteps.h"

namespace poise::stepping {

/// The pendulum has no legs: a heavy one that swings takes the capture point back, and each
/// foothold with it, so that steps come to less than they are commanded. Ahead, aside and in a turn
/// a factor of the command is led by what the last two steps came to. Pure function of its calls.
class StrideCorrection {
 public:
  /// A foot has landed. `middle`, `heading`: m and rad, world, between the soles; `command`: what
  /// was walked. Only two steps of one command tell anything.
  void Land(double time, const Eigen::Vector2d& middle, double heading, const WalkCommand& command);
  /// The robot stands, or a push has moved a foot: the next landing is the first one.
  void Forget() { count_ = 0; }
  /// The command that comes to `command`.
  WalkCommand Corrected(const WalkCommand& command) const;
  const Eigen::Vector3d& factor() const { return factor_; }  ///< ahead, aside, in a turn
  void Archive(StateArchive* archive);

 private:
  struct Step {
    Eigen::Vector3d way = Eigen::Vector3d::Zero();      // m, m, rad, in axes of its mean heading
    Eigen::Vector3d command = Eigen::Vector3d::Zero();  // m/s, m/s, rad/s
    double duration = 0;                                // s
  };

  Step last_;
  double time_ = 0;                                   // s, of the last landing
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();  // m, then
  double heading_ = 0;                                // rad, then
  int count_ = 0;                                     // landings since it knows nothing, 2 at most
  Eigen::Vector3d factor_ = Eigen::Vector3d::Ones();
};

}  // namespace poise::stepping
