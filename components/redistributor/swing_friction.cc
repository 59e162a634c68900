#include "components/redistributor/swing_friction.h"

#include <algorithm>
#include <cmath>

#include "components/balance/minimum_jerk.h"

namespace poise {

using robot::Foot;
using robot::FootArray;
using robot::kFeet;

double FrictionTorque(const robot::MotorModel& motor, double velocity, double smoothing) {
  return motor.coulomb_friction * std::tanh(velocity / smoothing) +
         motor.viscous_friction * velocity;
}

SwingFriction::SwingFriction(const FrictionCompensation& config, const robot::RobotModel& model,
                             double period)
    : share_(config.share()),
      lead_(config.lead()),
      smoothing_(config.smoothing_velocity()),
      rate_(period / config.ramp()),
      fade_load_(config.fade_load()) {
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
      const bool fades = ramped && load[f] < fade_load_;
      open = fades ? 1 - std::max(load[f], 0.0) / fade_load_ : 0;
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
        share_ * balance::SmoothStep(swing) * FrictionTorque(joint.motor, asked, smoothing_);
  }
}

}  // namespace poise
