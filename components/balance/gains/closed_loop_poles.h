// The poles of a standing robot with its controller: what a set of gains does with the robot's
// gears, rotors, current loops, delay and velocity filter.
//
// The robot is linearised about its stance. Links move on the feet's contacts; each joint's rotor
// is a body of its own behind a gear (k, d), driven by a current loop of first order. Every tick
// reads the encoders and the base's motion as they were sensor_delay ago, filters the joints'
// velocities, predicts over the delay as the invariant filter does, and computes the torque of the
// task controller. The map of one tick is exact: matrix exponential, torque held over the tick.
// Left out: friction but the viscous one, backlash, rounding, redistribution, and the estimator's
// slow states (biases, soles).
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "components/balance/tasks/task.h"
#include "components/robot/robot_model.h"

namespace poise::balance {

/// What the rule of docs/reference/gains.md derives, or a scenario gives.
struct StandingGains {
  TaskGains com, orientation, foot, posture;
  double velocity_cutoff = 20;  ///< Hz, of the low-pass on joint velocities
  /// Hz, of a low-pass of first order on the base's velocity for the tasks; 0: none. Gears that
  /// ring between motor and link, which IMU and base are part of, are then not fed.
  double base_velocity_cutoff = 0;
};

/// What of a new reading the low-pass takes over in a tick of `period` s.
double BaseVelocityShare(double cutoff, double period);

/// The state in which a robot stands by its stance; on one foot with the COM above its sole and the
/// other foot `lift` (m) up. RobotError when it cannot be reached.
robot::RobotState StandingState(const robot::RobotModel& model,
                                const robot::FootArray<bool>& in_contact, double lift = 0.02);

/// Changes to the loop that a margin is measured with.
struct LoopChange {
  double feedback = 1;     ///< times the torque's dependence on the state
  double extra_delay = 0;  ///< s, more than the robot's own, that no prediction knows of
  double gear_stiffness = 1, rotor_inertia = 1;  ///< times the robot's
};

struct ClosedLoopPoles {
  /// A pole z of the tick's map as the s = ln z / T of a continuous one.
  struct Mode {
    std::complex<double> z, s;
    double frequency = 0;  ///< Hz, |s| / 2π
    double damping = 1;    ///< −Re s / |s|
  };
  std::vector<Mode>
      modes;  ///< slowest decay first; one of a conjugate pair; no pole nearer to 0 than 1e-3
  double spectral_radius = 0;  ///< below 1: it stands
  bool stable() const { return spectral_radius < 1; }
  /// Returns the least damping ratio of the modes below `frequency` Hz; 1 without one.
  double LeastDamping(double frequency = 1e9) const;
};

/// `in_contact`: right first. `period` s, of the tick. RobotError when the stance cannot be reached
/// or its contacts are singular.
ClosedLoopPoles ComputeClosedLoopPoles(const robot::RobotModel& model, const StandingGains& gains,
                                       const robot::FootArray<bool>& in_contact, double period,
                                       const LoopChange& change = {});

/// Where the search for a margin ends.
inline constexpr double kMostGain = 4;
inline constexpr int kMostDelay = 5;  // ticks

/// The largest factor on the feedback, from 1 up to `most`, with which it still stands, to a
/// twentieth; below 1 when it does not stand at all: 0.
double GainMargin(const robot::RobotModel& model, const StandingGains& gains,
                  const robot::FootArray<bool>& in_contact, double period, double most = kMostGain);
/// The largest additional delay in ticks, up to `most`, with which it still stands; −1: not even
/// without.
int DelayMargin(const robot::RobotModel& model, const StandingGains& gains,
                const robot::FootArray<bool>& in_contact, double period, int most = kMostDelay);

}  // namespace poise::balance
