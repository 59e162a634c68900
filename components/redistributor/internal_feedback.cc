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

InternalWrench DistributionError(const std::array<balance::Vector6d, 2>& measured,
                                 const std::array<Eigen::Isometry3d, 2>& foot, double eta) {
  const balance::Vector6d right = IntoO(foot[0]) * measured[0];
  const balance::Vector6d resultant = right + IntoO(foot[1]) * measured[1];
  const auto wanted = balance::DistributeResultant(resultant, foot, eta);
  return IntoO(foot[0]) * wanted[0] - right;
}

Eigen::Matrix<double, 12, 1> WrenchChange(const InternalWrench& internal,
                                          const std::array<Eigen::Isometry3d, 2>& foot) {
  Eigen::Matrix<double, 12, 1> change;
  for (int i = 0; i < 2; ++i) {
    const auto f = static_cast<size_t>(i);
    // From O into the sole's frame: the transform of the inverse pose.
    change.segment<6>(6 * i) =
        (i == 0 ? 1.0 : -1.0) *
        (balance::WrenchTransform(foot[f], Eigen::Isometry3d::Identity()) * internal);
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
