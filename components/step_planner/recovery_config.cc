#include "components/step_planner/recovery_config.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "components/balance/tasks/centroidal_momentum.h"
#include "components/framework/configuration/configuration.h"
#include "components/robot/dynamics.h"
#include "components/robot/posture.h"
#include "components/robot/sole.h"
#include "components/step_planner/leg_limits.h"

namespace poise {
namespace {

// Share of the way between the hips that two legs take: beside each other they are clear.
constexpr double kLegShare = 0.6;
// Share of the weight that an observed load must be above to be a landing: a leg that brakes its
// swing was seen to be misjudged by 0.05, by more than three standard deviations.
constexpr double kObservedLoad = 0.15;

/// m/s² that the hips' joints can give a sole with `share` of their effort: of the leg's joints the
/// two that swing it furthest, each with the inertia of all that it carries about its own axis.
double SwingAcceleration(const robot::RobotModel& model, double share) {
  robot::RobotState state(model.num_joints());
  state.joint_position = model.stance().joint_position;
  robot::RobotData data(model);
  robot::ComputeKinematics(model, state, &data);
  robot::ComputeFeet(model, &data);
  robot::ComputeDynamics(model, state, &data);
  double least = std::numeric_limits<double>::infinity();
  for (size_t f = 0; f < 2; ++f) {
    // By direction, ahead and sideways, the best joint.
    for (const int axis : {0, 1}) {
      double best = 0;
      for (const int j : model.supporting_joints(model.feet()[f].body)) {
        const double arm = std::abs(data.foot_jacobian[f](axis, 6 + j));
        const double inertia = data.mass_matrix(6 + j, 6 + j);
        const double effort = model.joints()[static_cast<size_t>(j)].effort;
        // The hip's: a joint near the foot moves little but the foot itself.
        if (arm >= 0.5 * robot::StandingHeight(model)) {
          best = std::max(best, share * effort / inertia * arm);
        }
      }
      if (best > 0) least = std::min(least, best);
    }
  }
  return least;
}

/// kg·m² about the COM, ahead and sideways the lesser, with which the body turns while soles and
/// COM stay where they are.
double TurningInertia(const robot::RobotModel& model) {
  robot::RobotState state(model.num_joints());
  state.joint_position = model.stance().joint_position;
  robot::RobotData data(model);
  robot::ComputeKinematics(model, state, &data);
  robot::ComputeFeet(model, &data);
  robot::ComputeDynamics(model, state, &data);
  std::vector<int> moving{0, 1, 2, 3, 4, 5};
  for (const robot::FootModel& foot : model.feet()) {
    for (const int j : model.supporting_joints(foot.body)) moving.push_back(6 + j);
  }
  robot::Matrix6X body(6, model.num_velocities());
  robot::ComputePointJacobian(model, data, model.body_task_body(), Eigen::Vector3d::Zero(), body);
  Eigen::MatrixXd momentum = Eigen::MatrixXd::Zero(3, model.num_velocities());
  Eigen::Vector3d bias;
  balance::ComputeAngularMomentumRows(data, momentum, &bias);
  const auto columns = static_cast<Eigen::Index>(moving.size());
  Eigen::MatrixXd held(18, columns);
  for (Eigen::Index c = 0; c < columns; ++c) {
    const int from = moving[static_cast<size_t>(c)];
    held.col(c) << data.foot_jacobian[0].col(from), data.foot_jacobian[1].col(from),
        data.com_jacobian.col(from), body.col(from).tail<3>();
  }
  const auto solver = held.completeOrthogonalDecomposition();
  double least = std::numeric_limits<double>::infinity();
  for (const int axis : {0, 1}) {
    Eigen::VectorXd wanted = Eigen::VectorXd::Zero(18);
    wanted[15 + axis] = 1;
    const Eigen::VectorXd velocity = solver.solve(wanted);
    Eigen::VectorXd all = Eigen::VectorXd::Zero(model.num_velocities());
    for (Eigen::Index c = 0; c < columns; ++c) all[moving[static_cast<size_t>(c)]] = velocity[c];
    least = std::min(least, std::abs(momentum.row(axis).dot(all)));
  }
  return least;
}

}  // namespace

void CheckRecoveryConfig(const RecoveryConfig& config) {
  const auto check = [](bool holds, const char* name, const char* must) {
    if (!holds) throw ConfigError(std::string("recovery.") + name, must);
  };
  const auto not_negative = [&](double value, const char* name) {
    check(value >= 0 && std::isfinite(value), name, "must be a number, 0 or more");
  };
  const auto positive = [&](double value, const char* name) {
    check(value > 0 && std::isfinite(value), name, "must be a number above 0");
  };
  not_negative(config.sure(), "sure");
  not_negative(config.reserve(), "reserve");
  not_negative(config.beyond(), "beyond");
  not_negative(config.again_after(), "again_after");
  check(config.max_steps() >= 1, "max_steps", "must be 1 or more");
  positive(config.unload(), "unload");
  not_negative(config.momentum(), "momentum");
  positive(config.load(), "load");
  not_negative(config.edge(), "edge");
  not_negative(config.overshoot(), "overshoot");
  not_negative(config.enough(), "enough");
  positive(config.clearance(), "clearance");
  positive(config.touch_speed(), "touch_speed");
  positive(config.freeze(), "freeze");
  positive(config.least_swing(), "least_swing");
  check(config.swing_effort() > 0 && config.swing_effort() <= 1, "swing_effort",
        "must be a share above 0, at most 1");
  not_negative(config.touch_duration(), "touch_duration");
  not_negative(config.settle(), "settle");
  positive(config.lower(), "lower");
  not_negative(config.joint_reserve(), "joint_reserve");
  not_negative(config.gap(), "gap");
  not_negative(config.leg_distance(), "leg_distance");
  positive(config.gain(), "gain");
  not_negative(config.lean_rate(), "lean_rate");
  not_negative(config.swing_budget(), "swing_budget");
  not_negative(config.catch_budget(), "catch_budget");
  positive(config.far(), "far");
  positive(config.height_rate(), "height_rate");
  positive(config.rest_distance(), "rest_distance");
  positive(config.rest_speed(), "rest_speed");
  positive(config.rest_time(), "rest_time");
  not_negative(config.together_after(), "together_after");
  positive(config.together_shift(), "together_shift");
  positive(config.together_swing(), "together_swing");
  not_negative(config.lingering(), "lingering");
  not_negative(config.lingering_time(), "lingering_time");
}

stepping::StepChoice MakeStepChoice(const RecoveryConfig& config, const robot::RobotModel& model) {
  for (const robot::FootModel& foot : model.feet()) {
    if (config.edge() < robot::InnerRadius(foot)) continue;
    throw ConfigError("recovery.edge",
                      fmt::format("is {} m and leaves nothing of the {} foot's sole, {} x {} m",
                                  config.edge(), foot.name, foot.length, foot.width));
  }
  const stepping::Reach reach(model, robot::StandingHeight(model), config.lower(),
                              config.joint_reserve(), config.gap());
  if (reach.empty()) {
    throw ConfigError("recovery.lower",
                      fmt::format("is {} m; robot '{}' cannot stand {} m lower than {} m with "
                                  "joint_reserve {} rad: change one of them",
                                  config.lower(), model.name(), config.lower(),
                                  robot::StandingHeight(model), config.joint_reserve()));
  }
  if (config.has_gap()) CheckGap("recovery", config.gap(), model, reach);
  if (config.has_clearance()) CheckClearance("recovery", config.clearance(), model);
  stepping::StepLimits limits;
  limits.edge = config.edge();
  limits.acceleration = SwingAcceleration(model, config.swing_effort());
  limits.least_swing = config.least_swing();
  limits.unload = config.unload();
  limits.beyond = config.overshoot();
  limits.enough = config.enough();
  limits.spacing = std::max(robot::StandingSpacing(model), reach.least_spacing());
  limits.leg_distance = config.has_leg_distance()
                            ? config.leg_distance()
                            : std::max(std::max(model.feet()[0].width, model.feet()[1].width),
                                       kLegShare * stepping::Legs(model).hip_spacing());
  return {model, reach, limits};
}

stepping::Recovery MakeRecovery(const RecoveryConfig& config, const ContactConfirmation& contact,
                                const robot::RobotModel& model, double watch) {
  stepping::RecoverySpec spec;
  spec.sure = config.sure();
  spec.reserve = config.reserve();
  spec.beyond = config.beyond();
  spec.again_after = config.again_after();
  spec.lingering = config.lingering();
  spec.lingering_time = config.lingering_time();
  spec.max_steps = config.max_steps();
  spec.momentum = config.momentum();
  spec.load = config.load();
  spec.swing = {config.clearance(), config.touch_speed(), config.freeze()};
  spec.touch_load = contact.touch_load();
  spec.touch_duration = config.touch_duration();
  spec.observed_load = kObservedLoad * model.total_mass() * robot::kGravity;
  spec.settle = config.settle();
  spec.search_depth = contact.search_depth();
  spec.gain = config.gain();
  spec.turn_share = TurningInertia(model) / (model.total_mass() * robot::kGravity);
  spec.lean_rate = config.lean_rate();
  spec.swing_budget = config.swing_budget();
  spec.catch_budget = config.catch_budget();
  spec.far = config.far();
  spec.height_rate = config.height_rate();
  spec.rest_distance = config.rest_distance();
  spec.rest_speed = config.rest_speed();
  spec.rest_time = config.rest_time();
  spec.watch = watch;
  spec.together_after = config.together_after();
  spec.together_shift = config.together_shift();
  spec.together_swing = config.together_swing();
  return {MakeStepChoice(config, model), spec};
}

}  // namespace poise
