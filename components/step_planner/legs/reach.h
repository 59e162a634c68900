// Where a robot can put its feet: polygons of its legs, by inverse kinematics.
#pragma once

#include <Eigen/Core>
#include <array>

#include "components/balance/convex_polygon.h"
#include "components/robot/robot_model.h"
#include "components/step_planner/legs/feet.h"

namespace poise::stepping {

/// A foot's sole, `margin` (m) off its edges, its frame at `centre`, turned by `yaw`, rad.
balance::ConvexPolygon SoleAt(const robot::FootModel& foot, double margin,
                              const Eigen::Vector2d& centre, double yaw);
/// Hull of two polygons; of the corners beyond what a polygon holds the last are left out.
balance::ConvexPolygon HullOf(const balance::ConvexPolygon& a, const balance::ConvexPolygon& b);
/// How a foot crosses the sole that stands: not at all, it comes down on its own side.
enum class Crossing { kNone, kInFront, kBehind };

/// The legs' reach for an upright body with level soles. All in axes of the body's heading, x
/// ahead, y to the left, m.
class Reach {
 public:
  /// rad off the joints' limits at footholds: as far as a leg's joint overshoots.
  static constexpr double kJointReserve = 0.1;

  /// Nothing is reached.
  Reach() = default;
  /// At two heights of the COM above the soles: standing, and `lowering` m below. A leg's joints
  /// keep `kJointReserve` off their limits, and a straight knee as far off. `gap`, m: between the
  /// soles, sideways. Never throws; a robot that cannot stand there has no reach.
  Reach(const robot::RobotModel& model, double height, double lowering, double gap);

  bool empty() const {
    for (const auto& leg : leg_) {
      if (leg[0].num_corners < 3 || leg[1].num_corners < 3) return true;
    }
    return false;
  }
  /// Sole centre of `foot` from the COM, with the COM lowered by `share` of `lowering`, 0 to 1.
  /// Where the polygons of both heights have unlike numbers of corners, that of standing below 1.
  balance::ConvexPolygon Leg(Foot foot, double share) const;
  /// Least share of `lowering` with which the soles stand at `offset` from the COM by foot; above
  /// 1, and by how many m, when even the lowest does not do.
  double LoweringShare(const FootArray<Eigen::Vector2d>& offset) const;
  /// Least share of `lowering`, 0 to 1, with which the soles stand at `offset`, or all of it where
  /// that brings them nearer. It leaves out legs that it brings no nearer, as one whose ankle is at
  /// its limit.
  double UsefulLowering(const FootArray<Eigen::Vector2d>& offset) const;
  /// m by which the COM stays beside the middle of the sole of `stance`, at the least, at either
  /// height: 0 where the leg stands right below it.
  double BesideCom(Foot stance) const;
  /// `com`, or the nearest place where it can be with the sole of `stance` at the origin: lowered
  /// by `share` of `lowering`, in that leg's reach or `roll` beyond it.
  Eigen::Vector2d ComAbove(Foot stance, const Eigen::Vector2d& com, double share = 1) const;
  /// Sole centre of `foot`, the other's at the origin and the COM above `ComAbove` of `com`,
  /// lowered by `share`: the leg's reach, and beside the other sole, ahead of it or behind it,
  /// `gap` between them. So the legs span what is between the soles, wherever `com` is. Beside, the
  /// legs do not cross; of the other two that is not said.
  balance::ConvexPolygon Footholds(Foot foot, const Eigen::Vector2d& com,
                                   Crossing crossing = Crossing::kNone, double share = 1) const;
  double least_spacing() const { return least_spacing_; }  ///< m between the soles' centres
  double least_ahead() const { return least_ahead_; }      ///< the same, one ahead of the other
  double lowering() const { return lowering_; }            ///< m
  /// m, of the longer sole: a stance foot that rolls over its edge lets the COM go no farther than
  /// that beyond its leg's reach.
  double roll() const { return roll_; }

 private:
  // By foot, by height: standing, lowered.
  FootArray<std::array<balance::ConvexPolygon, 2>> leg_;
  double least_spacing_ = 0, least_ahead_ = 0, lowering_ = 0, roll_ = 0;
};

/// A joint's position.
struct JointAt {
  int joint = 0;
  double position = 0;  ///< rad
};
/// The joints of the legs that come nearer than `kJointReserve` to a limit, or beyond it, where a
/// leg stands with its level sole right below the COM, `height` m above it, the body as it stands.
/// Empty as well where the robot does not stand so high.
std::vector<JointAt> JointsBelowCom(const robot::RobotModel& model, double height);

}  // namespace poise::stepping
