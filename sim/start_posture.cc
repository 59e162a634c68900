#include "sim/start_posture.h"

#include <Eigen/QR>
#include <string>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/robot/posture.h"

namespace poise {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Translation3d;
using Eigen::Vector3d;
using robot::FootArray;
using robot::kFeet;
using robot::RobotData;
using robot::RobotModel;
using robot::RobotState;
using robot::Vector6d;

RobotState SolveStart(const RobotModel& model, const StartPosture& config) {
  robot::PostureGoal goal;
  // Joints of the scenario's own are another posture than the robot's stance.
  const bool stands = config.nominal_size() == 0;
  goal.nominal = stands ? model.stance().joint_position : Eigen::VectorXd::Zero(model.num_joints());
  for (int i = 0; i < config.nominal_size(); ++i) {
    const auto& entry = config.nominal(i);
    const std::string field = "start.nominal[" + std::to_string(i) + "]";
    const int joint = model.FindJoint(entry.joint());
    if (joint < 0) {
      std::string names;
      for (const auto& known : model.joints()) names += (names.empty() ? "" : ", ") + known.name;
      throw ConfigError(field + ".joint", "no joint '" + entry.joint() + "'; use one of " + names);
    }
    goal.nominal[joint] = entry.position();
  }

  RobotData data(model);
  const auto evaluate = [&](const Eigen::VectorXd& joints) { data = Evaluate(model, joints); };
  StartPosture complete = config;
  if (!config.has_foot_spacing() && model.stance().foot_spacing) {
    complete.set_foot_spacing(*model.stance().foot_spacing);
  } else if (!config.has_foot_spacing()) {
    evaluate(Eigen::VectorXd::Zero(model.num_joints()));
    complete.set_foot_spacing(data.foot_pose[robot::Foot::kLeft].translation().y() -
                              data.foot_pose[robot::Foot::kRight].translation().y());
  }
  if (!config.has_com_height() && stands && model.stance().com_height) {
    complete.set_com_height(*model.stance().com_height);
  } else if (!config.has_com_height()) {
    evaluate(goal.nominal);
    complete.set_com_height(data.com.z() - data.foot_pose[robot::Foot::kRight].translation().z());
  }
  CheckFields(complete, "start.");  // what followed from the robot
  const double spacing = complete.foot_spacing();

  goal.foot[robot::Foot::kRight] = Isometry3d(Translation3d(0, -spacing / 2, 0));
  goal.foot[robot::Foot::kLeft] =
      Isometry3d(Translation3d(0, spacing / 2, config.left_foot_height()));
  const double above_right = config.left_foot_height() > 0 ? -spacing / 2 : 0;
  goal.com_xy = {config.com_x(), config.has_com_y() ? config.com_y() : above_right};
  goal.com_height = complete.com_height();
  try {
    return robot::SolvePosture(model, goal);
  } catch (const robot::RobotError& error) {
    throw ConfigError("start", error.what());
  }
}

FootArray<Vector6d> RestWrenches(const RobotModel& model, const RobotState& state,
                                 const FootArray<bool>& in_contact) {
  const RobotData data = Evaluate(model, state);
  const double arm = model.feet()[robot::Foot::kRight].length / 2;
  // Force and moment about the COM, world axes, of the wrenches [f; m / arm] in the sole frames.
  Eigen::Matrix<double, 6, 12> balance = Eigen::Matrix<double, 6, 12>::Zero();
  for (const robot::Foot f : kFeet) {
    if (!in_contact[f]) continue;
    const Isometry3d& sole = data.foot_pose[f];
    const Eigen::Index column = 6 * static_cast<Eigen::Index>(f);
    const Matrix3d r = sole.linear();
    const Vector3d lever = sole.translation() - data.com;
    balance.block<3, 3>(0, column) = r;
    for (int i = 0; i < 3; ++i) balance.block<3, 1>(3, column + i) = lever.cross(r.col(i));
    balance.block<3, 3>(3, column + 3) = arm * r;
  }
  Vector6d weight = Vector6d::Zero();
  weight.z() = model.total_mass() * robot::kGravity;
  Eigen::Matrix<double, 12, 1> wrenches = balance.completeOrthogonalDecomposition().solve(weight);
  FootArray<Vector6d> result;
  for (const robot::Foot f : kFeet) {
    result[f] = wrenches.segment<6>(6 * static_cast<Eigen::Index>(f));
    result[f].tail<3>() *= arm;
  }
  return result;
}

Eigen::VectorXd RestTorques(const RobotModel& model, const RobotState& state,
                            const FootArray<Vector6d>& wrenches) {
  const RobotData data = Evaluate(model, state);
  Eigen::VectorXd force = data.gravity;
  for (const robot::Foot f : kFeet) {
    const Matrix3d r = data.foot_pose[f].linear();
    Vector6d wrench;
    wrench << r * wrenches[f].head<3>(), r * wrenches[f].tail<3>();
    force -= data.foot_jacobian[f].transpose() * wrench;
  }
  return force.tail(model.num_joints());
}

}  // namespace poise
