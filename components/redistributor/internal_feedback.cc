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

// s, time constant with which the answer is let go: no step that a standing robot feels.
constexpr double kReleaseTime = 0.1;
// Share of the load from which on the lighter foot is given the whole answer: a foot that hardly
// touches cannot follow.
constexpr double kFullShare = 0.1;

double TwoDigits(double value) {
  if (!(value > 0)) return 0;
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

balance::Matrix6d IntoO(const Eigen::Isometry3d& foot) {
  return balance::WrenchTransform(Eigen::Isometry3d::Identity(), foot);
}

}  // namespace

FeedbackLimits LimitsOfFeedback(const robot::RobotModel& model) {
  constexpr double kForceShare = 3.0 / 16;  // of the weight: what friction in the legs holds up
  constexpr double kLever = 0.4;            // of the COM's height
  constexpr double kEdgeShare = 0.2;        // of the smaller sole's inner radius
  const double weight = model.total_mass() * robot::kGravity;
  const double force = TwoDigits(kForceShare * weight);
  return {force, TwoDigits(kLever * robot::StandingHeight(model) * force),
          kEdgeShare * SoleRadius(model)};
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

InternalWrench InternalFeedback::Limited(InternalWrench wrench) const {
  const auto limit = [](auto part, double most) {
    const double size = part.norm();
    if (size > most) part *= most / size;
  };
  limit(wrench.head<3>(), limits_.force);
  limit(wrench.tail<3>(), limits_.moment);
  return wrench;
}

void InternalFeedback::Release(double period) {
  const double counted = TickPeriod(period);
  integral_ *= counted > 0 ? kReleaseTime / (kReleaseTime + counted) : 1.0;
}

double InternalFeedback::LoadShare(double eta) const {
  const double lighter = std::min(eta, 1 - eta);
  return lighter >= kFullShare ? 1.0 : balance::SmoothStep(lighter / kFullShare);
}

InternalWrench InternalFeedback::Update(const InternalWrench& error, double period, double share) {
  if (!error.allFinite()) return Hold(share);
  integral_ = Limited(integral_ + share * rate_ * TickPeriod(period) * error);
  return Hold(share);
}

}  // namespace poise
