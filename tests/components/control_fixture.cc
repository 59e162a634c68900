#include "tests/components/control_fixture.h"

#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <regex>
#include <stdexcept>

#include "components/messages/motion.h"
#include "components/robot/posture.h"
#include "poise/message_traits.hpp"

namespace poise {

Tick TickAt(int64_t index) {
  const int64_t utime = index * kTickMicroseconds;
  return {.index = index, .utime = utime, .time = static_cast<double>(utime) * 1e-6};
}

support_plan_t HoldAt(const robot::RobotModel& model, const robot::RobotData& data,
                      const Contacts& in_contact) {
  support_plan_t plan{};
  MessageTraits<support_plan_t>::Resize(plan, std::array{2});
  SetMotion(PointMotion{.position = data.com}, &plan.com_reference);
  const auto body = static_cast<size_t>(model.body_task_body());
  SetMotion(RotationMotion{.rotation = data.body_rotation[body]}, &plan.body_reference);
  for (size_t i = 0; i < 2; ++i) {
    plan.in_contact[i] = in_contact[i] ? 1 : 0;
    SetMotion(PointMotion{.position = data.foot_pose[i].translation()}, &plan.foot_reference[i]);
    SetMotion(RotationMotion{.rotation = data.foot_pose[i].linear()},
              &plan.foot_rotation_reference[i]);
  }
  return plan;
}

ControlContext::ControlContext(const std::string& robot_path)
    : resources_{{"robot", robot::ReadWhole(robot_path)}} {
  std::smatch urdf;
  if (!std::regex_search(resources_["robot"], urdf, std::regex("urdf: *\"([^\"]+)\""))) {
    throw std::invalid_argument(robot_path + " names no URDF");
  }
  const auto folder = std::filesystem::path(robot_path).parent_path();
  resources_["urdf"] = robot::ReadWhole((folder / urdf[1].str()).string());
}

void ControlContext::Configure(Component* component, const std::string& config, Wiring* wiring) {
  ComponentContext context;
  context.name = "under_test";
  context.config_text = config;
  context.tick_period = 1e-6 * kTickMicroseconds;
  context.resources = &resources_;
  context.shared = &shared_;
  component->Configure(context, wiring);
}

robot::RobotState StandingState(const robot::RobotModel& model) {
  robot::RobotState bent(model.num_joints());
  for (int j = 0; j < model.num_joints(); ++j) {
    std::string name;  // of any maker's spelling: L_HipPitch_Joint, left_hip_pitch
    for (const char c : model.joints()[static_cast<size_t>(j)].name) {
      if (c != '_') name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    const bool hip = name.find("hippitch") != std::string::npos;
    const bool knee = name.find("knee") != std::string::npos;
    const bool ankle = name.find("anklepitch") != std::string::npos;
    bent.joint_position[j] = knee ? 0.7 : hip || ankle ? -0.35 : 0.0;
  }
  const robot::RobotData data = robot::Evaluate(model, bent);
  const Eigen::Vector3d apart = data.foot_pose[1].translation() - data.foot_pose[0].translation();
  robot::PostureGoal goal;
  for (size_t i = 0; i < 2; ++i) {
    goal.foot[i] = Eigen::Isometry3d::Identity();
    goal.foot[i].translation().y() = (i == 0 ? -0.5 : 0.5) * apart.y();
  }
  const double sole_height =
      0.5 * (data.foot_pose[0].translation() + data.foot_pose[1].translation()).z();
  goal.com_height = 0.98 * (data.com.z() - sole_height);
  goal.nominal = bent.joint_position;
  return robot::SolvePosture(model, goal);
}

robot::RobotState Disturbed(const robot::RobotState& state, double position, double velocity,
                            std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto draw = [&](Eigen::Index size) {
    return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(size, [&] { return uniform(*random); }));
  };
  const Eigen::Index n = 6 + state.joint_position.size();
  robot::RobotState result = robot::Moved(state, position * draw(n), 1.0);
  robot::SetVelocity(velocity * draw(n), &result);
  return result;
}

robot_state_t StateMessage(const robot::RobotModel& model, const robot::RobotState& state) {
  robot_state_t message{};
  MessageTraits<robot_state_t>::Resize(message, std::array{model.num_joints(), 2});
  const Eigen::Quaterniond& q = state.base_orientation;
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy_n(wxyz, 4, message.base_orientation);
  std::copy_n(state.base_position.data(), 3, message.base_position);
  std::copy_n(state.base_linear_velocity.data(), 3, message.base_linear_velocity);
  std::copy_n(state.base_angular_velocity.data(), 3, message.base_angular_velocity);
  std::copy_n(state.joint_position.data(), model.num_joints(), message.joint_position.begin());
  std::copy_n(state.joint_velocity.data(), model.num_joints(), message.joint_velocity.begin());
  return message;
}

Dynamics::Dynamics(const robot::RobotModel& model, const robot::RobotState& state,
                   const Contacts& in_contact)
    : data(robot::Evaluate(model, state)) {
  const Eigen::Index n = model.num_velocities();
  const Eigen::Index rows = 6 * ((in_contact[0] ? 1 : 0) + (in_contact[1] ? 1 : 0));
  contact_jacobian.resize(rows, n);
  contact_bias.resize(rows);
  Eigen::Index row = 0;
  for (size_t i = 0; i < 2; ++i) {
    if (!in_contact[i]) continue;
    Eigen::Matrix<double, 6, 6> to_sole = Eigen::Matrix<double, 6, 6>::Zero();
    to_sole.topLeftCorner<3, 3>() = data.foot_pose[i].linear().transpose();
    to_sole.bottomRightCorner<3, 3>() = data.foot_pose[i].linear().transpose();
    contact_jacobian.middleRows(row, 6) = to_sole * data.foot_jacobian[i];
    contact_bias.segment(row, 6) = to_sole * data.foot_bias_acceleration[i];
    row += 6;
  }
}

void Dynamics::Forward(const Eigen::VectorXd& torque, Eigen::VectorXd* acceleration,
                       Eigen::VectorXd* wrench) const {
  const Eigen::Index n = data.mass_matrix.rows(), m = contact_jacobian.rows();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + m, n + m);
  system.topLeftCorner(n, n) = data.mass_matrix;
  system.topRightCorner(n, m) = contact_jacobian.transpose();
  system.bottomLeftCorner(m, n) = contact_jacobian;
  Eigen::VectorXd right(n + m);
  right << -data.bias - data.gravity, -contact_bias;
  right.segment(6, n - 6) += torque;
  const Eigen::VectorXd solution = system.fullPivLu().solve(right);
  *acceleration = solution.head(n);
  *wrench = solution.tail(m);
}

Eigen::VectorXd ToEigen(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

std::string TaskControllerText() {
  return "com { kp: 225 kd: 10 } orientation { kp: 150 kd: 20 } foot { kp: 100 kd: 15 } "
         "posture { kp: 80 kd: 12 }";
}

std::string MonitorConfig(bool balancing, double half_length, double half_width) {
  const std::string length = std::to_string(half_length), width = std::to_string(half_width);
  return std::string("balancing: ") + (balancing ? "true" : "false") +
         " double_support { half_length: " + length + " half_width: " + width +
         " } single_support { half_length: 0.12 half_width: 0.06 }";
}

std::string RedistributorText(const std::string& extra) {
  return "double_support { half_length: 0.12 half_width: 0.05 } "
         "single_support { half_length: 0.12 half_width: 0.06 } " +
         extra;
}

}  // namespace poise
