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

/// What follows from the robot: docs/reference/robots.md has the rules.
struct FeedbackLimits {
  double force = 0, moment = 0;  ///< N, and N·m about frame O, of the answer on the right foot
  /// m from the edge of its sole, nearer than which a foot's computed centre of pressure counts as
  /// about to tip.
  double edge = 0;
};
FeedbackLimits LimitsOfFeedback(const robot::RobotModel& model);

/// Integral, within limits; by time, whatever ticks are skipped.
class InternalFeedback {
 public:
  InternalFeedback() = default;
  InternalFeedback(const WrenchFeedback& config, const FeedbackLimits& limits)
      : enabled_(config.enabled()), rate_(config.integral()), limits_(limits) {}

  bool enabled() const { return enabled_; }
  /// 1/s; may change between calls.
  double* integral_rate() { return &rate_; }
  /// Begins at zero again.
  void Reset() { integral_.setZero(); }
  /// `period`, s, since the last call. A `share` (0..1) of the answer is given, and integrated.
  InternalWrench Update(const InternalWrench& error, double period, double share);
  /// Lets the answer go in a tenth of a second; `period`, s, since the last call.
  void Release(double period);
  /// Share of the answer that acts with this ratio: all while the lighter foot has a tenth of
  /// the load or more, none without load.
  double LoadShare(double eta) const;
  /// The answer where there is no reading to go by.
  InternalWrench Hold(double share) const { return share * integral_; }
  void Archive(StateArchive* archive) { archive->Show(integral_); }

 private:
  InternalWrench Limited(InternalWrench wrench) const;

  bool enabled_ = false;
  double rate_ = 0;
  FeedbackLimits limits_;
  InternalWrench integral_ = InternalWrench::Zero();
};

}  // namespace poise
