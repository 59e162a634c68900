#include "components/step_planner/recovery_config.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "components/balance/tasks/centroidal_momentum.h"
#include "components/framework/configuration/configuration.h"
#include "components/robot/dynamics.h"
#include "components/robot/posture.h"
#include "components/robot/sole.h"
#include "components/step_planner/legs/leg_limits.h"
#include "components/step_planner/planner_config.h"

namespace poise {
namespace {

// Share of the way between the hips that two legs take: beside each other they are clear.
constexpr double kLegShare = 0.6;
// m that the centre of pressure asked for keeps off a sole's edge: what it is off by in a step.
constexpr double kSoleMargin = 0.02;
// m beyond the capture point that the sole's centre comes down: what is left for errors of the
// prediction. Fitted, as the numbers below, to pushes of the paper's robot
// (docs/reference/steps.md).
constexpr double kOvershoot = 0.04;
// m of the capture point inside the new support, beyond which a foothold is no better.
constexpr double kAmpleMargin = 0.04;
// Share of the hip joints' effort that a planned swing may ask for. Fitted: G1 with 12 joints
// stands 37 of 60 pushes with 0.9 and 42 with 1.2 (docs/lab/walking).
constexpr double kSwingEffort = 1.2;
// s of the ramp (61) before a foot leaves the ground, and s in the air at least. On a point mass
// shorter ones catch no more (docs/lab/steps/2026-11-28-level-feet.md).
constexpr double kPushUnload = 0.02, kLeastSwing = 0.12;
constexpr double kGap = 0.02;  // m between the soles, sideways
// Share of the standing height by which steps lower the COM. A walk's COM is as low, where one leg
// can hold the robot so. Fitted: the tour of G1 with 29 joints, 64 runs, lasts 51 s with 0.08 and a
// walk's 0.06, and 59 s with 0.1 (docs/lab/walking/2026-11-30-how-low-a-walk.md).
constexpr double kStepLowering = 0.1;
// Share of the weight that an observed load must be above to be a landing: a leg that brakes its
// swing was seen to be misjudged by 0.05, by more than three standard deviations.
constexpr double kObservedLoad = 0.15;

constexpr double kMostStepTurn = 0.5;  // rad in a step: a hip turns by as much

/// m/s² that the hips' joints can give a sole with all their effort: of the leg's joints the two
/// that swing it furthest, each with the inertia of all that it carries about its own axis.
double SwingAcceleration(const robot::RobotModel& model) {
  const robot::RobotData data = robot::Evaluate(model, model.stance().joint_position);
  double least = std::numeric_limits<double>::infinity();
  for (const robot::Foot f : robot::kFeet) {
    // By direction, ahead and sideways, the best joint.
    for (const int axis : {0, 1}) {
      double best = 0;
      for (const int j : model.supporting_joints(model.feet()[f].body)) {
        const double arm = std::abs(data.foot_jacobian[f](axis, 6 + j));
        const double inertia = data.mass_matrix(6 + j, 6 + j);
        const double effort = model.joints()[static_cast<size_t>(j)].effort;
        // The hip's: a joint near the foot moves little but the foot itself.
        if (arm >= 0.5 * robot::StandingHeight(model)) {
          best = std::max(best, effort / inertia * arm);
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
  const robot::RobotData data = robot::Evaluate(model, model.stance().joint_position);
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
    held.col(c) << data.foot_jacobian[robot::Foot::kRight].col(from),
        data.foot_jacobian[robot::Foot::kLeft].col(from), data.com_jacobian.col(from),
        body.col(from).tail<3>();
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

stepping::StepChoice MakeStepChoice(const robot::RobotModel& model) {
  for (const robot::FootModel& foot : model.feet()) {
    if (kSoleMargin < robot::InnerRadius(foot)) continue;
    throw ConfigError("recovery",
                      fmt::format("keeps the centre of pressure {} m off a sole's edge, "
                                  "which leaves nothing of the {} foot's, {} x {} m",
                                  kSoleMargin, foot.name, foot.length, foot.width));
  }
  const double height = robot::StandingHeight(model);
  const double lowering = kStepLowering * height;
  const stepping::Reach reach(model, height, lowering, kGap);
  if (reach.empty()) {
    throw ConfigError("recovery",
                      fmt::format("lowers the COM by {} m; robot '{}' cannot stand so much lower "
                                  "than {} m with its joints {} rad off their limits: its file's "
                                  "stance or limits leave no room to step",
                                  lowering, model.name(), height, stepping::Reach::kJointReserve));
  }
  stepping::StepLimits limits;
  limits.sole_margin = kSoleMargin;
  limits.acceleration = kSwingEffort * SwingAcceleration(model);
  limits.least_swing = kLeastSwing;
  limits.unload = kPushUnload;
  limits.overshoot = kOvershoot;
  limits.ample_margin = kAmpleMargin;
  limits.spacing = std::max(robot::StandingSpacing(model), reach.least_spacing());
  limits.longest = LongestStride(reach, limits.spacing);
  limits.widest = std::max(0.0, WidestStance(reach) - limits.spacing);
  limits.most_turn = kMostStepTurn;
  limits.leg_distance = std::max(std::max(model.feet()[0].width, model.feet()[1].width),
                                 kLegShare * stepping::Legs(model).hip_spacing());
  return {model, reach, limits};
}

stepping::RecoverySpec MakeRecoverySpec(const RecoveryConfig& config,
                                        const ContactConfirmation& contact,
                                        const robot::RobotModel& model, double watched_margin) {
  stepping::RecoverySpec spec;
  spec.margin_to_sole_edge = config.margin_to_sole_edge();
  spec.landing = MakeLandingSpec(contact);
  spec.landing.observed_load = kObservedLoad * model.total_mass() * robot::kGravity;
  // The first load counts: the foot bounces, and six milliseconds of steady load came 0.12 s late.
  spec.landing.touch_duration = spec.landing.settle = 0;
  spec.landing.retracts = false;
  spec.landing.search_speed = stepping::Recovery::kSwing.touch_speed;
  spec.turn_share = TurningInertia(model) / (model.total_mass() * robot::kGravity);
  spec.watched_margin = watched_margin;
  spec.holding_lowering = MostLowering(model, kStepLowering * robot::StandingHeight(model));
  return spec;
}

stepping::Recovery MakeRecovery(const RecoveryConfig& config, const ContactConfirmation& contact,
                                const robot::RobotModel& model, double watched_margin) {
  return {MakeStepChoice(model), MakeRecoverySpec(config, contact, model, watched_margin)};
}

}  // namespace poise
