#include "components/redistributor/internal_feedback.h"

#include <algorithm>
#include <cmath>

#include "components/balance/contact_conditions.h"
#include "components/balance/distribution_ratio.h"
#include "components/balance/minimum_jerk.h"
#include "components/framework/tick_time.h"
#include "components/messages/conversions.h"
#include "components/robot/posture.h"

namespace poise {
namespace {

using robot::Foot;
using robot::FootArray;

double TwoDigits(double value) {
  if (!(value > 0)) return 0;
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

balance::Matrix6d IntoO(const Eigen::Isometry3d& foot) {
  return balance::WrenchTransform(Eigen::Isometry3d::Identity(), foot);
}

}  // namespace

WrenchFeedback WithRobotLimits(WrenchFeedback feedback, const robot::RobotModel& model) {
  constexpr double kForceShare = 3.0 / 16;  // of the weight: what friction in the legs holds up
  constexpr double kLever = 0.4;            // of the COM's height
  constexpr double kEdgeShare = 0.2;        // of the smaller sole's inner radius
  const double weight = model.total_mass() * robot::kGravity;
  const double force = TwoDigits(kForceShare * weight);
  if (!feedback.has_max_force()) feedback.set_max_force(force);
  if (!feedback.has_max_moment()) {
    feedback.set_max_moment(TwoDigits(kLever * robot::StandingHeight(model) * force));
  }
  if (!feedback.has_edge()) {
    feedback.set_edge(kEdgeShare * SoleRadius(model));
  }
  return feedback;
}

InternalWrench DistributionError(const FootArray<balance::Vector6d>& measured,
                                 const FootArray<Eigen::Isometry3d>& foot, double eta) {
  const balance::Matrix6d right_into_o = IntoO(foot[Foot::kRight]);
  const balance::Vector6d right = right_into_o * measured[Foot::kRight];
  const balance::Vector6d resultant = right + IntoO(foot[Foot::kLeft]) * measured[Foot::kLeft];
  const auto wanted = balance::DistributeResultant(resultant, foot, eta);
  return right_into_o * wanted[Foot::kRight] - right;
}

Eigen::Matrix<double, 12, 1> WrenchChange(const InternalWrench& internal,
                                          const FootArray<Eigen::Isometry3d>& foot) {
  Eigen::Matrix<double, 12, 1> change;
  for (const Foot f : robot::kFeet) {
    // From O into the sole's frame: the transform of the inverse pose.
    change.segment<6>(6 * static_cast<Eigen::Index>(f)) =
        -Side(f) * (balance::WrenchTransform(foot[f], Eigen::Isometry3d::Identity()) * internal);
  }
  return change;
}

InternalFeedback::InternalFeedback(const WrenchFeedback& config)
    : enabled_(config.enabled()),
      proportional_(config.proportional()),
      rate_(config.integral()),
      max_force_(config.max_force()),
      max_moment_(config.max_moment()),
      release_time_(config.release_time()),
      full_load_(config.full_load()) {}

InternalWrench InternalFeedback::Limited(InternalWrench wrench) const {
  const auto limit = [](auto part, double most) {
    const double size = part.norm();
    if (size > most) part *= most / size;
  };
  limit(wrench.head<3>(), max_force_);
  limit(wrench.tail<3>(), max_moment_);
  return wrench;
}

void InternalFeedback::Release(double period) {
  const double counted = TickPeriod(period);
  integral_ *= counted > 0 ? release_time_ / (release_time_ + counted) : 1.0;
}

double InternalFeedback::LoadShare(double eta) const {
  const double lighter = std::min(eta, 1 - eta);
  return lighter >= full_load_ ? 1.0 : balance::SmoothStep(lighter / full_load_);
}

InternalWrench InternalFeedback::Update(const InternalWrench& error, double period, double share) {
  if (!error.allFinite()) return Hold(share);
  integral_ = Limited(integral_ + share * rate_ * TickPeriod(period) * error);
  return share * Limited(integral_ + proportional_ * error);
}

}  // namespace poise
