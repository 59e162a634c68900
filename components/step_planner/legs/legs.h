// Where a robot's legs are: lines from hip to knee to ankle, and how near they come to each other.
#pragma once

#include <Eigen/Core>

#include "components/robot/robot_model.h"
#include "components/step_planner/legs/feet.h"

namespace poise::stepping {

/// One leg's joints, m.
struct LegLine {
  Eigen::Vector3d hip = Eigen::Vector3d::Zero();
  Eigen::Vector3d knee = Eigen::Vector3d::Zero();
  Eigen::Vector3d ankle = Eigen::Vector3d::Zero();
};

/// Legs of two links under an upright body with level soles, the knees bent the way that they are
/// in the robot's stance. All in axes of the body's heading, m.
class Legs {
 public:
  Legs() = default;
  /// Hip, knee and ankle of each foot's chain of joints: its first, the one farthest from both its
  /// ends, and its last. Throws RobotError where the robot cannot stand.
  explicit Legs(const robot::RobotModel& model);

  /// `sole`: its centre from the COM.
  LegLine At(Foot foot, const Eigen::Vector3d& sole) const;
  /// m of the COM above a level sole, its centre at `sole` from the COM, where the leg is `stretch`
  /// of a straight one; as if below the hip where it reaches no farther.
  double Highest(Foot foot, const Eigen::Vector2d& sole, double stretch) const;
  /// m from COM to soles in the stance.
  double height() const { return height_; }
  /// m sideways between the hips.
  double hip_spacing() const { return (leg_[0].hip - leg_[1].hip).norm(); }

 private:
  struct Leg {
    Eigen::Vector3d hip = Eigen::Vector3d::Zero();    // from the COM
    Eigen::Vector3d ankle = Eigen::Vector3d::Zero();  // from the sole's centre
    double thigh = 0, shank = 0, bent = 1;            // bent: 1 ahead, −1 behind
  };
  FootArray<Leg> leg_;
  double height_ = 0;
};

/// m between two segments a–b and c–d.
double SegmentDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d);
/// m between the lines of two legs. Less 2 r it is the distance of legs that are capsules of the
/// radius r.
double LegDistance(const LegLine& a, const LegLine& b);

}  // namespace poise::stepping
