#include "components/redistributor/swing_friction.h"

#include <algorithm>
#include <cmath>

#include "components/balance/minimum_jerk.h"

namespace poise {

using robot::Foot;
using robot::FootArray;
using robot::kFeet;

namespace {

constexpr double kSmoothing = 0.05;  // rad/s
// s in which the torque comes or goes at the quickest.
constexpr double kFrictionRamp = 0.05;
// Share of F_z from which on a foot in contact holds its leg against friction by itself, and gets
// none. The less it carries the more it gets.
constexpr double kFadeLoad = 0.5;

}  // namespace

double FrictionTorque(const robot::MotorModel& motor, double velocity) {
  return motor.coulomb_friction * std::tanh(velocity / kSmoothing) +
         motor.viscous_friction * velocity;
}

SwingFriction::SwingFriction(const FrictionCompensation& config, const robot::RobotModel& model,
                             double period)
    : share_(config.share()), lead_(config.lead()), rate_(period / kFrictionRamp) {
  if (share_ == 0) return;
  for (int j = 0; j < model.num_joints(); ++j) {
    const Joint joint{j, model.CarriedFeet(j), model.motors()[static_cast<size_t>(j)]};
    if (Count(joint.carries) > 0) joints_.push_back(joint);
  }
}

void SwingFriction::Ramp(const FootArray<bool>& in_contact, bool ramped, double eta) {
  if (joints_.empty()) return;
  const FootArray<double> load{eta, 1 - eta};
  for (const Foot f : kFeet) {
    double open = 1;
    if (in_contact[f]) {
      const bool fades = ramped && load[f] < kFadeLoad;
      open = fades ? 1 - std::max(load[f], 0.0) / kFadeLoad : 0;
    }
    swing_[f] = std::clamp(open, swing_[f] - rate_, swing_[f] + rate_);
  }
}

void SwingFriction::Add(const Eigen::Ref<const Eigen::VectorXd>& velocity,
                        const Eigen::Ref<const Eigen::VectorXd>& acceleration,
                        std::span<double> torque) const {
  for (const Joint& joint : joints_) {
    const auto left_by = [&](Foot f) { return joint.carries[f] ? swing_[f] : 1.0; };
    const double swing = std::min(left_by(Foot::kRight), left_by(Foot::kLeft));
    if (swing == 0) continue;
    const double asked = velocity[joint.index] + lead_ * acceleration[joint.index];
    torque[static_cast<size_t>(joint.index)] +=
        share_ * balance::SmoothStep(swing) * FrictionTorque(joint.motor, asked);
  }
}

}  // namespace poise
