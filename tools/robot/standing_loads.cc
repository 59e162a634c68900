#include "tools/robot/standing_loads.h"

#include "components/robot/dynamics.h"
#include "components/robot/posture.h"
#include "sim/start_posture.h"

namespace poise {
namespace {

// Shares of the stance's height that a posture on one foot is looked for at, the first that is in
// reach: sideways over the foot a leg must be longer.
constexpr std::array kHeights = {1.0, 0.98, 0.95, 0.9};

}  // namespace

Eigen::VectorXd HoldingTorque(const robot::RobotModel& model, const robot::RobotState& state,
                              const std::array<bool, 2>& in_contact) {
  return RestTorques(model, state, RestWrenches(model, state, in_contact)).cwiseAbs();
}

std::optional<robot::RobotState> OnOneFoot(const robot::RobotModel& model,
                                           const robot::RobotState& stance, size_t foot) {
  const robot::RobotData data = robot::Evaluate(model, stance);
  robot::PostureGoal goal;
  goal.foot = {data.foot_pose[0], data.foot_pose[1]};
  goal.com_xy = goal.foot[foot].translation().head<2>();
  goal.nominal = stance.joint_position;
  for (const double share : kHeights) {
    const double ground = goal.foot[foot].translation().z();
    goal.com_height = ground + share * (data.com.z() - ground);
    try {
      return robot::SolvePosture(model, goal);
    } catch (const robot::RobotError&) {
      continue;  // out of reach
    }
  }
  return {};
}

std::optional<Eigen::VectorXd> OneFootTorque(const robot::RobotModel& model,
                                             const robot::RobotState& stance) {
  Eigen::VectorXd torque = Eigen::VectorXd::Zero(model.num_joints());
  for (size_t foot = 0; foot < 2; ++foot) {
    const std::optional<robot::RobotState> state = OnOneFoot(model, stance, foot);
    if (!state) return {};
    torque = torque.cwiseMax(HoldingTorque(model, *state, {foot == 0, foot == 1}));
  }
  return torque;
}

}  // namespace poise
