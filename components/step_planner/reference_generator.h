// Desired COM, body orientation and foot poses over time.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "components/framework/state_archive.h"
#include "components/messages/motion.h"
#include "components/messages/quintic.h"
#include "components/robot/foot.h"
#include "components/step_planner/step_planner.pb.h"

namespace poise {

/// A move that begins after its phase's delay; until then the one before it goes on.
class ReferencePoint {
 public:
  void Hold(const Eigen::Vector3d& position);
  /// Replaces a move that has not begun yet.
  void Schedule(const Eigen::Vector3d& target, double start, double duration);
  /// From any motion to rest at `target`, in place of what was under way.
  void Lead(const PointMotion& from, const Eigen::Vector3d& target, double start, double duration);
  /// `time` must not decrease from call to call.
  PointMotion At(double time);
  /// Goes on with the move under way at the share `rate` of its speed, for the `period` s until
  /// `time`; the motion there.
  PointMotion Slow(double time, double period, double rate);
  /// Where and when, s, the last move ends.
  const Eigen::Vector3d& target() const { return target_; }
  double end() const { return start_ + duration_; }
  void Archive(StateArchive* archive);

 private:
  QuinticMove move_;
  bool pending_ = false;
  Eigen::Vector3d target_ = Eigen::Vector3d::Zero();
  double start_ = 0, duration_ = 0;
};

/// A frame that turns by a rotation vector which a ReferencePoint leads; at rest until then.
class ReferenceTurn {
 public:
  /// At rest at `rotation`, from where later turns count.
  void Hold(const Eigen::Matrix3d& rotation);
  /// To the rotation vector `target`, rad, world axes, counted from the last Hold. Replaces a turn
  /// that has not begun yet.
  void Schedule(const Eigen::Vector3d& target, double start, double duration);
  /// `time` must not decrease from call to call.
  RotationMotion At(double time);
  void Archive(StateArchive* archive);

 private:
  Eigen::Matrix3d origin_ = Eigen::Matrix3d::Identity();
  ReferencePoint vector_;  // rad
};

/// What the references are anchored to: the robot as it is estimated, world frame, m.
struct EstimatedPose {
  Eigen::Vector3d com = Eigen::Vector3d::Zero();
  Eigen::Matrix3d body_rotation = Eigen::Matrix3d::Identity();
  robot::FootArray<Eigen::Isometry3d> sole{Eigen::Isometry3d::Identity(),
                                           Eigen::Isometry3d::Identity()};
};

struct References {
  PointMotion com;
  RotationMotion body;
  robot::FootArray<PointMotion> foot;  ///< sole centre; meaningful for a foot out of contact
  robot::FootArray<RotationMotion> foot_rotation;  ///< likewise

  void Archive(StateArchive* archive);
};

/// References start from the estimated pose, and at each phase from where they stand, in position,
/// velocity and acceleration. A phase without a COM reference lets the motion under way end. After
/// a phase of gravity compensation they start from the estimated pose again.
class ReferenceGenerator {
 public:
  /// m, of the COM behind a move of its reference, at which the move stands still; from half of it
  /// on it slows down. What the centre of pressure's region or the joints' friction holds back
  /// would else be asked for by ever more acceleration.
  static constexpr double kComLag = 0.03;

  /// First tick: everything holds where it is. COM targets of the phase are set relative to that.
  void BeginPhase(const Phase& phase, const EstimatedPose& estimate, double time);
  /// Once a tick. The COM's move waits for the COM at `com`, m, world.
  const References& Update(double time, const Eigen::Vector3d& com);
  /// From here on the free foot rests there; its moves under way and to come are dropped.
  void HoldFoot(robot::Foot foot, const Eigen::Vector3d& position, const Eigen::Matrix3d& rotation);
  /// COM and body come to rest here, from their present motion, in `duration` s; the feet's moves
  /// under way are dropped. After another planner has led them.
  void Anchor(const EstimatedPose& estimate, const PointMotion& com,
              const Eigen::Vector3d& com_target, double time, double duration);
  /// The COM's reference goes on from where it rests by `way`, m, world, in `duration` s. A phase
  /// that begins meanwhile takes the shift for done.
  void ShiftCom(const Eigen::Vector3d& way, double time, double duration) {
    com_.Schedule(com_.target() + way, time, duration);
    shifts_ = true;
  }
  /// m, world: where the COM's last move ends.
  const Eigen::Vector3d& com_target() const { return com_.target(); }
  /// Whether the COM's reference has come to rest, and no move of it is to come.
  bool ComMoveEnded(double time) const { return time >= com_.end(); }
  /// The body rests at `rotation` from here on; its turns under way and to come are dropped.
  void HoldBody(const Eigen::Matrix3d& rotation) { body_turn_.Hold(rotation); }
  const ReferencePoint& foot(robot::Foot foot) const { return foot_[foot]; }
  void Archive(StateArchive* archive);

 private:
  Eigen::Vector3d ComTarget(const ComReference& com, const EstimatedPose& estimate,
                            const Eigen::Vector3d& standing) const;

  double time_ = 0;  // s, of the last update
  bool anchored_ = false;
  bool shifts_ = false;  // the COM's last move is a shift
  robot::FootArray<bool> foot_free_{false, false};
  ReferencePoint com_;
  robot::FootArray<ReferencePoint> foot_;
  ReferenceTurn body_turn_;
  robot::FootArray<ReferenceTurn> foot_turn_;
  References references_;
};

}  // namespace poise
