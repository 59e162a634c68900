#include "logging/derived/definitions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "components/balance/contact_conditions.h"
#include "components/balance/convex_polygon.h"
#include "components/messages/conversions.h"
#include "poise/drive_feedback_t.hpp"

namespace poise::logging {
namespace {

constexpr double kLightShare = 0.01;  // of the weight
// A reading beyond this many standard deviations of its noise is a load.
constexpr double kNoiseDeviations = 5;

Eigen::Quaterniond Rotation(const double (&q)[4]) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
}

/// The soles in the world: as the planner estimates them; without its report the true ones.
std::optional<std::array<Eigen::Isometry3d, 2>> Soles(const RunMessages& run,
                                                      const TickView& tick) {
  const auto poses = [](const auto* message) -> std::optional<std::array<Eigen::Isometry3d, 2>> {
    if (message == nullptr) return {};
    return std::array{GetPose(message->foot_pose[0]), GetPose(message->foot_pose[1])};
  };
  return run.planner ? poses(tick.planner) : poses(tick.truth);
}

using FootWrenches = std::array<std::optional<Wrench>, 2>;  // empty: out of contact

/// Returns the centre of pressure of wrenches on soles that stood so at `tick`; empty in the air.
std::optional<PlacedCop> CopOf(const robot::RobotModel& robot, const RunMessages& run,
                               const TickView& tick, const FootWrenches& wrenches) {
  const auto soles = Soles(run, tick);
  if (!soles) return {};
  PlacedCop result;
  if (run.balance) {
    if (tick.balance == nullptr) return {};
    result.frame = GetPose(tick.balance->frame_o);
  } else if (!balance::FrameO(*soles, {wrenches[0].has_value(), wrenches[1].has_value()},
                              &result.frame)) {
    return {};
  }
  Wrench resultant = Wrench::Zero();
  for (size_t foot = 0; foot < 2; ++foot) {
    if (!wrenches[foot]) continue;
    resultant += balance::WrenchTransform(result.frame, (*soles)[foot]) * *wrenches[foot];
  }
  if (!(std::abs(resultant(2)) > LightLoad(robot))) return {};  // in the air
  result.cop = balance::CenterOfPressure(resultant);
  return result;
}

}  // namespace

double LightLoad(const robot::RobotModel& robot) {
  return kLightShare * robot.total_mass() * robot::kGravity;
}

double LeastReadLoad(const robot::RobotModel& robot) {
  return kNoiseDeviations * robot.force_noise();
}

bool TellsFoot(const joint_command_t& command, size_t foot) {
  if (command.conditions_met[foot] != 0) return true;
  if (command.in_contact[foot] == 0) return false;
  const contact_margins_t& m = command.margins[foot];
  return !GetWrench(command.foot_wrench[foot]).isZero(0) || m.normal != 0 || m.friction != 0 ||
         m.yaw != 0 || m.roll != 0 || m.pitch != 0;
}

bool TellsRatio(const joint_command_t& command) {
  return command.eta_feasible != 0 || command.eta_max != 0;  // 1 where none is feasible
}

std::optional<Wrench> ComputedWrench(const TickView& tick, size_t foot) {
  const joint_command_t* command = tick.command;
  if (command == nullptr || command->in_contact[foot] == 0 || !TellsFoot(*command, foot)) return {};
  return GetWrench(command->foot_wrench[foot]);
}

std::optional<Wrench> KnownWrench(const robot::RobotModel& robot, const TickView& tick,
                                  size_t foot) {
  const robot_state_t* state = tick.state;
  if (state != nullptr && foot < state->foot_wrench_source.size() &&
      state->foot_wrench_source[foot] == robot_state_t::SOURCE_OBSERVER) {
    return GetWrench(state->foot_wrench[foot]);
  }
  const robot_sensors_t* sensors = tick.sensors;
  if (sensors == nullptr || !robot.feet()[foot].force_sensor ||
      sensors->foot_sensor[foot] != drive_feedback_t::SENSOR_OK) {
    return {};
  }
  return GetWrench(sensors->foot_wrench[foot]);
}

std::optional<Eigen::Vector2d> ComputedCop(const robot::RobotModel& robot, const RunMessages& run,
                                           const TickView& tick) {
  if (run.balance) {
    if (tick.balance == nullptr) return {};
    return Eigen::Vector2d(tick.balance->cop[0], tick.balance->cop[1]);
  }
  const auto placed = CopOf(robot, run, tick, {ComputedWrench(tick, 0), ComputedWrench(tick, 1)});
  if (!placed) return {};
  return placed->cop;
}

std::optional<PlacedCop> MeasuredCop(const robot::RobotModel& robot, const RunMessages& run,
                                     const TickView& before, const TickView& now) {
  if (run.plan && before.plan == nullptr) return {};
  FootWrenches wrenches;
  for (size_t foot = 0; foot < 2; ++foot) {
    if (before.plan != nullptr && before.plan->in_contact[foot] == 0) continue;
    const auto wrench = KnownWrench(robot, now, foot);
    if (!wrench) return {};
    const bool carries = before.plan != nullptr || -(*wrench)[2] > LeastReadLoad(robot);
    if (carries) wrenches[foot] = *wrench;
  }
  return CopOf(robot, run, before, wrenches);
}

std::optional<Eigen::Vector4d> ContactRatios(const Wrench& wrench, double least) {
  const double load = std::abs(wrench(2));
  if (!(load >= least && load > 0)) return {};
  return Eigen::Vector4d(std::hypot(wrench(0), wrench(1)), std::abs(wrench(5)), std::abs(wrench(3)),
                         std::abs(wrench(4))) /
         load;
}

std::optional<Eigen::Vector4d> ContactLimits(const robot::RobotModel& robot, const TickView& tick,
                                             size_t foot) {
  const auto wrench = ComputedWrench(tick, foot);
  if (!wrench) return {};
  const auto ratios = ContactRatios(*wrench, LightLoad(robot));
  if (!ratios) return {};
  const contact_margins_t& m = tick.command->margins[foot];
  const Eigen::Vector4d left(m.friction, m.yaw, m.roll, m.pitch);
  if (left.isZero(0)) return {};  // a controller that computes none
  Eigen::Vector4d limits = *ratios + left / std::abs((*wrench)(2));
  if (m.roll == m.pitch)
    limits.tail<2>().setConstant(std::nan(""));  // the nearest edge's of a sole
  // What is left and what is taken are rounded differently in each tick, and the limit is one.
  constexpr double kResolution = 1e-9;
  return ((limits / kResolution).array().round() * kResolution).matrix();
}

bool HasComReference(const support_plan_t& plan, int axis) {
  return axis == 2 || plan.com_follows == support_plan_t::FOLLOWS_REFERENCE;
}

std::optional<double> ComError(const support_plan_t& plan, const double (&com)[3], int axis) {
  if (!HasComReference(plan, axis)) return {};
  return com[axis] - plan.com_reference.position[axis];
}

std::optional<double> FootError(const support_plan_t& plan, const planner_status_t& planner,
                                size_t foot, int axis) {
  if (plan.in_contact[foot] != 0) return {};
  return planner.foot_pose[foot].position[axis] - plan.foot_reference[foot].position[axis];
}

std::optional<double> MotorTorque(const RunMessages& run, const TickView& tick, size_t joint) {
  const auto of = [joint](const auto* message, auto field) -> std::optional<double> {
    if (message == nullptr) return {};
    return (message->*field)[joint];
  };
  if (run.truth) return of(tick.truth, &ground_truth_t::joint_torque);
  if (run.bridge) return of(tick.bridge, &bridge_status_t::applied_torque);
  return of(tick.command, &joint_command_t::torque);
}

EstimatorError BaseError(const robot_state_t& estimate, const ground_truth_t& truth) {
  EstimatorError error;
  error.position = (GetVector3(estimate.base_position) - GetVector3(truth.base_position)).norm();
  error.velocity =
      (GetVector3(estimate.base_linear_velocity) - GetVector3(truth.base_linear_velocity)).norm();
  const Eigen::Quaterniond estimated = Rotation(estimate.base_orientation);
  const Eigen::Quaterniond actual = Rotation(truth.base_orientation);
  // The world's vertical seen from the base.
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d a = estimated.conjugate() * up;
  const Eigen::Vector3d b = actual.conjugate() * up;
  error.tilt = std::atan2(a.cross(b).norm(), a.dot(b));
  error.rotation = estimated.angularDistance(actual);
  return error;
}

Eigen::Matrix<double, 9, 1> BaseErrorVector(const robot_state_t& estimate,
                                            const ground_truth_t& truth) {
  Eigen::Quaterniond turn =
      Rotation(estimate.base_orientation) * Rotation(truth.base_orientation).conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const Eigen::AngleAxisd rotation(turn);
  Eigen::Matrix<double, 9, 1> error;
  error << rotation.angle() * rotation.axis(),
      GetVector3(estimate.base_linear_velocity) - GetVector3(truth.base_linear_velocity),
      GetVector3(estimate.base_position) - GetVector3(truth.base_position);
  return error;
}

std::optional<int> StepsThatCatch(const planner_status_t& planner,
                                  const steps::footsteps_t& footsteps) {
  if (footsteps.stance < 0) return {};
  constexpr int kRegions = std::extent_v<decltype(footsteps.corners)>;
  constexpr int kCorners = std::extent_v<decltype(footsteps.region_x)> / kRegions;
  const Eigen::Vector2d point(planner.capture_point[0], planner.capture_point[1]);
  bool any = false;
  for (int steps = 0; steps < kRegions; ++steps) {
    balance::ConvexPolygon region;
    region.num_corners = std::clamp<int>(footsteps.corners[steps], 0, kCorners);
    for (int i = 0; i < region.num_corners; ++i) {
      region.corner[static_cast<size_t>(i)] = {footsteps.region_x[steps * kCorners + i],
                                               footsteps.region_y[steps * kCorners + i]};
    }
    any = any || region.num_corners > 0;
    if (region.num_corners > 2 && balance::Contains(region, point)) return steps;
  }
  if (!any) return {};
  return kRegions;
}

}  // namespace poise::logging
