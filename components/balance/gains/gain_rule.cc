#include "components/balance/gains/gain_rule.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "components/robot/posture.h"

namespace poise::balance {
namespace {

constexpr double kStiffness = 2.75;  // times ω: stiffer than the fall that it stops
constexpr double kDamping = 0.7;     // of the COM and the body
constexpr double kPhase = 1.0 / 3;   // rad at k_d that the loop's delay may cost
// A foot in the air holds nothing up, so it may be stiffer and lag more. With the gains of the
// others it comes down beside its foothold (docs/lab/steps).
constexpr double kFootStiffness = 4, kFootPhase = 0.7;
constexpr double kHorizon = 3;          // of the loop's delay: with a third it would ring
constexpr double kVelocityCutoff = 20;  // Hz
// The cutoff is this share of the lowest frequency at which a rotor rings on its gear: a
// second-order low-pass leaves a sixteenth of the ringing.
constexpr double kGearShare = 0.25;
// A step takes more, since its legs are seldom at rest, and kVelocityCutoff at least. Fitted:
// heron, whose gears ring at 52 Hz, stands 33 of 96 pushes with 20 Hz and 5 with 60
// (docs/lab/steps).
constexpr double kStepGearShare = 0.3;
constexpr double kMostStepCutoff = 60;  // Hz: G1 stands fewer pushes with 80 (docs/lab/steps)

/// Hz, of the lowest at which a rotor rings on its gear; infinite where gears are rigid.
double GearFrequency(const robot::RobotModel& model) {
  const double stiffness = model.drive_train().gear_stiffness;
  double lowest = std::numeric_limits<double>::infinity();
  for (const robot::MotorModel& motor : model.motors()) {
    if (!(stiffness > 0 && motor.reflected_inertia > 0)) continue;
    lowest =
        std::min(lowest, std::sqrt(stiffness / motor.reflected_inertia) / (2 * std::numbers::pi));
  }
  return lowest;
}

}  // namespace

double PendulumFrequency(const robot::RobotModel& model) {
  return std::sqrt(robot::kGravity / robot::StandingHeight(model));
}

double VelocityDelay(const robot::RobotModel& model, double velocity_cutoff) {
  // A second-order Butterworth filter delays by √2/ω_c.
  return std::numbers::sqrt2 / (2 * std::numbers::pi * velocity_cutoff) +
         model.drive_train().sensor_delay;
}

double LoopDelay(const robot::RobotModel& model, double velocity_cutoff, double period) {
  return VelocityDelay(model, velocity_cutoff) + model.drive_train().torque_lag + 0.5 * period;
}

double LimitHorizon(const robot::RobotModel& model, double period) {
  return kHorizon * LoopDelay(model, VelocityCutoff(model), period);
}

double VelocityCutoff(const robot::RobotModel& model) {
  return std::min(kVelocityCutoff, kGearShare * GearFrequency(model));
}

double StepCutoff(const robot::RobotModel& model) {
  return std::clamp(kStepGearShare * GearFrequency(model), kVelocityCutoff, kMostStepCutoff);
}

StandingGains GainsByRule(const robot::RobotModel& model, double period) {
  StandingGains gains;
  gains.velocity_cutoff = VelocityCutoff(model);
  gains.base_velocity_cutoff = gains.velocity_cutoff;  // both parts of a velocity lag alike
  const double omega = PendulumFrequency(model);
  const double delay = LoopDelay(model, gains.velocity_cutoff, period);
  const auto of = [&](double stiffness, double damping, double phase) {
    const double frequency = std::min(stiffness * omega, phase / delay / (2 * damping));
    return TaskGains{frequency * frequency, 2 * damping * frequency};
  };
  gains.com = gains.orientation = of(kStiffness, kDamping, kPhase);
  gains.posture = of(kStiffness, 1, kPhase);
  gains.foot = of(kFootStiffness, 1, kFootPhase);
  return gains;
}

}  // namespace poise::balance
