// What follows from the messages of a tick: definitions that metrics, events and DerivedSignals
// share. An empty optional: the messages do not tell.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "components/robot/robot_model.h"
#include "logging/derived/tick_messages.h"

namespace poise::logging {

/// Which messages a run has, in any tick: what a message tells is not told by another one instead
/// where it is lost.
struct RunMessages {
  bool plan = false, planner = false, balance = false, bridge = false, truth = false;
};

using Wrench = Eigen::Matrix<double, 6, 1>;  ///< [force; moment], N, N·m

/// N, |F_z| from which on a wrench has a centre of pressure, and a computed one ratios: 1 % of the
/// weight. Below it rounding decides.
double LightLoad(const robot::RobotModel& robot);
/// A foot in contact that is to carry at least this share of the robot's weight counts as loaded:
/// below it the sensor's noise and the model's error decide what its wrench looks like.
inline constexpr double kLoadedShare = 0.05;
/// N, above which a foot's sensor reads a load: five standard deviations of its noise.
double LeastReadLoad(const robot::RobotModel& robot);

/// What a command says of contacts, wrenches, conditions and ratio is for the log alone, and a
/// controller that computes none of it leaves it zero. True when this one tells of the foot; of the
/// ratio.
bool TellsFoot(const joint_command_t& command, size_t foot);
bool TellsRatio(const joint_command_t& command);

/// The foot's wrench that the command is computed to cause, robot on environment, sole frame; empty
/// out of contact.
std::optional<Wrench> ComputedWrench(const TickView& tick, size_t foot);
/// The foot's wrench as the controller knows it, robot on environment, sole frame: the sensor's
/// reading, or the observer's where there is no good sensor. Empty without either.
std::optional<Wrench> KnownWrench(const robot::RobotModel& robot, const TickView& tick,
                                  size_t foot);

/// m, (r_x, r_y) in frame O, (37), (38), of the computed resultant: BALANCE_TORQUE's; in a run
/// without any, that of the command's wrenches.
std::optional<Eigen::Vector2d> ComputedCop(const robot::RobotModel& robot, const RunMessages& run,
                                           const TickView& tick);

/// A centre of pressure and the frame O that it is told in, in the world.
struct PlacedCop {
  Eigen::Vector2d cop;  ///< m
  Eigen::Isometry3d frame;
};
/// m, of what the feet read at `now`, of the feet in contact: as planned, in a run without
/// plan those that read a load. A reading shows the command of the tick before, so frame O and the
/// soles' poses are those of `before`: as estimated, in a run without plan and balancing the true
/// ones.
std::optional<PlacedCop> MeasuredCop(const robot::RobotModel& robot, const RunMessages& run,
                                     const TickView& before, const TickView& now);

/// Ratios of a sole's wrench to |F_z| that (30)-(33) limit: friction, yaw, roll, pitch. Empty below
/// `least` N.
std::optional<Eigen::Vector4d> ContactRatios(const Wrench& wrench, double least);
/// Their limits, by what the command has left of them; NaN of (32), (33) where the sole is no
/// rectangle.
std::optional<Eigen::Vector4d> ContactLimits(const robot::RobotModel& robot, const TickView& tick,
                                             size_t foot);

/// False while the COM follows a centre of pressure: then it has no reference in x and y.
bool HasComReference(const support_plan_t& plan, int axis);
/// m, world: a COM less its reference.
std::optional<double> ComError(const support_plan_t& plan, const double (&com)[3], int axis);
/// m, world: the estimated sole less its reference, of a foot out of contact.
std::optional<double> FootError(const support_plan_t& plan, const planner_status_t& planner,
                                size_t foot, int axis);

/// N·m that a joint's motor gave: in truth; of a real robot as the bridge ordered it, with what the
/// drive adds by stiffness and damping; without a bridge as commanded.
std::optional<double> MotorTorque(const RunMessages& run, const TickView& tick, size_t joint);

/// Estimate less truth of the base.
struct EstimatorError {
  double position = 0;  ///< m
  double velocity = 0;  ///< m/s, linear
  double tilt = 0;      ///< rad, angle between estimated and true vertical
  double rotation = 0;  ///< rad, whole rotation, heading included
};
EstimatorError BaseError(const robot_state_t& estimate, const ground_truth_t& truth);

/// BaseError as ESTIMATOR_STATUS orders it: orientation (rotation vector of estimate times truth
/// inverted, rad), linear velocity (m/s), position (m), world axes.
Eigen::Matrix<double, 9, 1> BaseErrorVector(const robot_state_t& estimate,
                                            const ground_truth_t& truth);

/// The fewest steps, 0 to 2, in whose region (steps::footsteps_t) the capture point is; 3: in none
/// of them.
std::optional<int> StepsThatCatch(const planner_status_t& planner,
                                  const steps::footsteps_t& footsteps);

}  // namespace poise::logging
