// Accelerations that keep a joint within its limits of position and velocity.
//
// Decré, Smits, Bruyninckx, De Schutter: Extending iTaSC to support inequality constraints, ICRA
// 2009; Del Prete: Joint position and velocity bounds in discrete-time acceleration/torque control,
// RA-L 2018. A state is viable when the joint can still be stopped before its limit. Held over the
// horizon, an acceleration within the range leads to viable states only.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "components/robot/robot_model.h"

namespace poise::balance {

/// Where a joint may be, how fast, and with what acceleration it may be stopped.
struct JointRange {
  double lower = 0, upper = 0;  ///< rad
  double velocity = 0;          ///< rad/s, > 0
  double acceleration = 0;      ///< rad/s², > 0
};

struct AccelerationRange {
  double lower = 0, upper = 0;  ///< rad/s², lower ≤ upper
};

/// Accelerations that, held over `horizon` (s, > 0), lead to viable states only. None is beyond
/// ±range.acceleration. In a state that is not viable any more the joint stops as hard as that.
AccelerationRange ViableAccelerations(const JointRange& range, double position, double velocity,
                                      double horizon);

/// rad: a joint's positions less the reserve that control keeps off their ends.
struct PositionRange {
  explicit PositionRange(const robot::Joint& joint);
  double lower, upper;
};

/// The ranges of a robot's joints. A share of what the URDF gives is kept in reserve: what the
/// velocity filter and the drive lag behind. The acceleration is that of half the joint's torque
/// limit against its own inertia in the stance, at most kHardest.
class JointLimits {
 public:
  JointLimits(const robot::RobotModel& model, double horizon);

  int num_joints() const { return static_cast<int>(ranges_.size()); }
  const JointRange& range(int joint) const { return ranges_[static_cast<size_t>(joint)]; }
  double horizon() const { return horizon_; }
  AccelerationRange Accelerations(int joint, double position, double velocity) const {
    return ViableAccelerations(range(joint), position, velocity, horizon_);
  }
  /// Accelerations for a joint of a leg that stands: beyond its range it is stopped, and not
  /// brought back. To bring it back would move the whole body, as hard as the joint alone could
  /// turn.
  AccelerationRange Stopping(int joint, double position, double velocity) const {
    const JointRange& own = range(joint);
    return Accelerations(joint, std::clamp(position, own.lower, own.upper), velocity);
  }
  /// Whether a limit is so near that the range is narrower than ±acceleration.
  bool Near(int joint, double position, double velocity) const {
    const AccelerationRange a = Accelerations(joint, position, velocity);
    const double most = range(joint).acceleration;
    return a.lower > -most || a.upper < most;
  }

  static constexpr double kPositionReserve = 0.02;  ///< rad, or a tenth of a joint's range
  static constexpr double kVelocityShare = 0.8;     ///< of the URDF's velocity limit
  static constexpr double kTorqueShare = 0.5;       ///< of the joint's torque limit
  static constexpr double kHardest = 60;            ///< rad/s²

 private:
  std::vector<JointRange> ranges_;
  double horizon_;
};

}  // namespace poise::balance
