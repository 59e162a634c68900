// Where the joints are to be that no task moves: where they stood, or where they are sent.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "components/balance/joint_limits.h"
#include "components/framework/state_archive.h"
#include "components/messages/quintic.h"
#include "operate/act_t.hpp"

namespace poise {

/// The posture's reference, a motion of each joint. Joints that no leg needs can be sent elsewhere:
/// arms, hands, head, waist. Never allocates after construction.
class PostureReference {
 public:
  /// `limits`: what a move keeps to. `legs`: joints between the base and a foot, which stay.
  /// `tick_period`: s.
  PostureReference(const balance::JointLimits& limits, std::span<const int> legs,
                   double tick_period);

  /// All joints rest at `position`, rad, n×1.
  void Hold(const Eigen::VectorXd& position);
  /// From its present motion the act's joint comes to rest at `value`, rad, in `duration` ticks, or
  /// in as many more as its limits of velocity and acceleration ask for. VERDICT_*: RANGE outside
  /// the joint's positions, NOT_ABLE of a leg, UNKNOWN of a joint that there is not.
  int8_t Move(const operate::act_t& act, double time);
  /// The motion at `time`, s, not decreasing.
  void Update(double time);
  /// rad, rad/s, rad/s², each n×1.
  const Eigen::VectorXd& position() const { return position_; }
  const Eigen::VectorXd& velocity() const { return velocity_; }
  const Eigen::VectorXd& acceleration() const { return acceleration_; }
  void Archive(StateArchive* archive);

 private:
  std::vector<balance::JointRange> range_;
  std::vector<char> leg_;
  double tick_period_;
  std::vector<Quintic> move_;
  std::vector<char> moves_;  // else it rests at position_
  Eigen::VectorXd position_, velocity_, acceleration_;
};

}  // namespace poise
