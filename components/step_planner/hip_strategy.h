// Hip strategy: the body turned as a flywheel when the feet alone cannot stop a push.
#pragma once

#include <Eigen/Core>

#include "components/framework/state_archive.h"
#include "components/messages/motion.h"
#include "components/messages/quintic.h"

namespace poise {

/// What the capture point and the joints say in one tick.
struct HipInput {
  double time = 0;  ///< s, not decreasing
  /// m, world, horizontal: the capture point less the nearest point of the soles' hull less
  /// kStart; zero inside.
  Eigen::Vector3d excess = Eigen::Vector3d::Zero();
  double margin = 0;  ///< m, of the capture point inside that hull; negative: outside
  bool near_joint_limit = false;
};

/// A capture point with excess e accelerates the body about z × e, head first after it: the
/// reaction moves the centroidal moment pivot I α / (m g) beyond the edge where the centre of
/// pressure is. The slower return costs as much, but later, when ω has let it fade by e^{−ωt}
/// (Pratt et al. 2006, Capture point; Stephens 2007, Humanoid push recovery).
class HipStrategy {
 public:
  enum class State { kUpright, kTilting, kTilted, kReturning };

  /// m inside the edge of the soles in contact, fitted as the two below
  /// (docs/reference/balance.md). Sooner: small pushes turn the body, too; later: the excess has
  /// grown.
  static constexpr double kStart = 0.02;
  static constexpr double kTilt = 0.6;  ///< rad that the body turns; 0.8 rad count as a fall
  /// s, by minimum jerk: 5.77 kTilt / kTiltTime² is the acceleration, some 28 rad/s².
  static constexpr double kTiltTime = 0.35;
  /// s in which a turn that ends early is stopped.
  static constexpr double kBrakeTime = 0.12;

  /// The body's tilt as a rotation vector in the world, rad, and its derivatives in time.
  PointMotion Update(const HipInput& input);
  State state() const { return state_; }
  void Archive(StateArchive* archive) { archive->Show(state_, since_, tilt_); }

 private:
  void Enter(State state, double time, const PointMotion& from, const Eigen::Vector3d& tilt,
             double duration);

  State state_ = State::kUpright;
  double since_ = 0;  // s, when the move under way began; while tilted: last time not well inside
  QuinticMove tilt_;
};

}  // namespace poise
