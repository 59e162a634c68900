// Feedback of measured foot wrenches that changes their distribution alone.
#pragma once

#include <Eigen/Geometry>

#include "components/balance/contact_dynamics.h"
#include "components/framework/state_archive.h"
#include "components/redistributor/redistributor.pb.h"
#include "components/robot/robot_model.h"

namespace poise {

/// Wrench on the right foot in frame O, [F; M]; its negative on the left foot: a resultant of zero.
using InternalWrench = balance::Vector6d;

/// What the feet lack to share their measured resultant at `eta` as (62)–(67) do. `measured`: robot
/// on environment, each in its sole frame; `foot`: soles in frame O.
InternalWrench DistributionError(const robot::FootArray<balance::Vector6d>& measured,
                                 const robot::FootArray<Eigen::Isometry3d>& foot, double eta);

/// The change of both feet's wrenches, each in its sole frame, 12×1, right first.
Eigen::Matrix<double, 12, 1> WrenchChange(const InternalWrench& internal,
                                          const robot::FootArray<Eigen::Isometry3d>& foot);

/// `config`, with what it leaves to the robot: docs/reference/robots.md has the rules.
WrenchFeedback WithRobotLimits(WrenchFeedback config, const robot::RobotModel& model);

/// Proportional and integral, within limits; by time, whatever ticks are skipped.
class InternalFeedback {
 public:
  InternalFeedback() = default;
  /// Takes a configuration with limits. Throws ConfigError "feedback.integral" ...: negative or not
  /// finite.
  explicit InternalFeedback(const WrenchFeedback& config);

  bool enabled() const { return enabled_; }
  /// 1/s; may change between calls.
  double* integral_rate() { return &rate_; }
  /// Begins at zero again.
  void Reset() { integral_.setZero(); }
  /// `period`, s, since the last call. A `share` (0..1) of the answer is given, and integrated.
  InternalWrench Update(const InternalWrench& error, double period, double share);
  /// Lets the answer go in release_time; `period`, s, since the last call.
  void Release(double period);
  /// Share of the answer that acts with this ratio: all while the lighter foot has full_load of the
  /// load or more, none without load.
  double LoadShare(double eta) const;
  /// The answer where there is no reading to go by.
  InternalWrench Hold(double share) const { return share * integral_; }
  void Archive(StateArchive* archive) { archive->Show(integral_); }

 private:
  InternalWrench Limited(InternalWrench wrench) const;

  bool enabled_ = false;
  double proportional_ = 0, rate_ = 0;
  double max_force_ = 0, max_moment_ = 0;
  double release_time_ = 0;  // s
  double full_load_ = 0;
  InternalWrench integral_ = InternalWrench::Zero();
};

}  // namespace poise
