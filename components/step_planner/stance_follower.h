// The COM's reference goes along with the soles that the robot stands on.
//
// A push that lifts or drags a foot leaves it elsewhere, and while soles slip the estimate of where
// the world is may slip with them. A reference that stays where it was in the world then holds the
// COM off the middle of the soles, nearer to an edge than the robot stood before.
#pragma once

#include <Eigen/Core>

#include "components/framework/state_archive.h"
#include "components/robot/foot.h"

namespace poise {

class StanceFollower {
 public:
  /// `distance`: m, not negative; 0: nothing is followed.
  explicit StanceFollower(double distance) : distance_(distance) {}

  /// What the robot stands on in a tick.
  struct Stance {
    /// m, world.
    robot::FootArray<Eigen::Vector3d> sole{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    Eigen::Vector3d com = Eigen::Vector3d::Zero();  ///< m, world, where its reference rests
    bool planned = false;  ///< both feet are contacts of the plan, which nothing else leads
    bool carried = false;  ///< both feet carry the robot
    bool resting = false;  ///< no move of the COM's reference is under way or to come
  };
  /// Once a tick, `time` in s, not decreasing. Returns how far the COM's reference is to be moved,
  /// m, world, horizontally; zero: not at all. The reference follows the point between the soles
  /// that lies nearest to it: halfway between them it follows both alike, above one sole that one
  /// alone. It begins to follow once this point has moved by `distance`, and then goes all the way.
  Eigen::Vector3d Update(double time, const Stance& stance);
  /// The COM's reference goes to where the soles are now: what they did before counts no more.
  void Restart() { known_ = following_ = false; }
  void Archive(StateArchive* archive) {
    archive->Show(known_, following_, carried_, since_, sole_);
  }

 private:
  double distance_;         // m
  bool known_ = false;      // sole_ is
  bool following_ = false;  // the soles have moved by more than the distance
  bool carried_ = false;    // in the last tick
  double since_ = 0;        // s, from when on
  // m, that the reference belongs to.
  robot::FootArray<Eigen::Vector3d> sole_{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
};

}  // namespace poise
