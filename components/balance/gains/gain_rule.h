// Gains that nobody sets: from the robot's mass, height, gears, delay and limits.
// docs/reference/gains.md has each rule with its reason, and the poles that it makes.
#pragma once

#include "components/balance/gains/closed_loop_poles.h"
#include "components/robot/robot_model.h"

namespace poise::balance {

/// rad/s, √(g/h) with h the COM's height in the stance.
double PendulumFrequency(const robot::RobotModel& model);

/// Hz, of the low-pass on joint velocities: well below every rotor on its gear, √(k/J).
double VelocityCutoff(const robot::RobotModel& model);
/// Hz, of that low-pass on the joints of a robot that steps.
double StepCutoff(const robot::RobotModel& model);

/// s by which the joints' velocities in a state are late: low-pass of `velocity_cutoff`, Hz, and
/// sensors.
double VelocityDelay(const robot::RobotModel& model, double velocity_cutoff);

/// s, from a joint's motion to the torque that answers it: VelocityDelay, current loop, half a
/// tick.
double LoopDelay(const robot::RobotModel& model, double velocity_cutoff, double period);

/// s, of the joints' limits (JointLimits): an approach to a limit is a loop of first order.
double LimitHorizon(const robot::RobotModel& model, double period);

/// The rule. `period` s, of the tick. Never fails: a robot that it cannot make stable has poles
/// that say so.
StandingGains GainsByRule(const robot::RobotModel& model, double period);

}  // namespace poise::balance
