#include "tests/components/control_tick.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace poise {
namespace {

// Newton steps on COM, body orientation and both soles from `state`; least norm where joints are
// left. False: they are out of reach, and what `state` has become depends on rounding.
bool Solve(const robot::RobotModel& model, const Eigen::Vector3d& com, const Eigen::Matrix3d& body,
           const std::array<Eigen::Isometry3d, 2>& sole, robot::RobotState* state) {
  const auto b = static_cast<size_t>(model.body_task_body());
  const auto turn = [](const Eigen::Matrix3d& to, const Eigen::Matrix3d& from) -> Eigen::Vector3d {
    const Eigen::AngleAxisd a(to * from.transpose());
    return a.angle() * a.axis();
  };
  robot::Matrix6X body_jacobian(6, model.num_velocities());
  for (int iteration = 0; iteration < 20; ++iteration) {
    const robot::RobotData now = robot::Evaluate(model, *state);
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(18, model.num_velocities());
    Eigen::VectorXd error(18);
    body_jacobian.setZero();
    robot::ComputePointJacobian(model, now, static_cast<int>(b), Eigen::Vector3d::Zero(),
                                body_jacobian);
    jacobian.topRows<3>() = now.com_jacobian;
    jacobian.middleRows<3>(3) = body_jacobian.bottomRows<3>();
    error.head<3>() = com - now.com;
    error.segment<3>(3) = turn(body, now.body_rotation[b]);
    for (size_t i = 0; i < 2; ++i) {
      const auto row = static_cast<Eigen::Index>(6 + 6 * i);
      jacobian.middleRows<6>(row) = now.foot_jacobian[i];
      error.segment<3>(row) = sole[i].translation() - now.foot_pose[i].translation();
      error.segment<3>(row + 3) = turn(sole[i].linear(), now.foot_pose[i].linear());
    }
    if (error.norm() < 1e-9) return true;
    const Eigen::VectorXd step =
        jacobian.transpose() * (jacobian * jacobian.transpose()).ldlt().solve(error);
    *state = robot::Moved(*state, step, 1.0);
  }
  return false;
}

/// With the COM on single support the share `lean` of its way to above the right sole; empty when
/// that is out of reach.
std::vector<robot_sensors_t> Sway(const robot::RobotModel& model, const Contacts& in_contact,
                                  int num_ticks, double lean) {
  robot::RobotState state = StandingState(model);
  const robot::RobotData start = robot::Evaluate(model, state);
  const auto b = static_cast<size_t>(model.body_task_body());
  const bool both = in_contact[0] && in_contact[1];
  const Eigen::Vector3d foot = start.foot_pose[0].translation();
  const double weight = model.total_mass() * robot::kGravity;

  std::vector<robot_sensors_t> sensors(static_cast<size_t>(num_ticks));
  Eigen::Matrix3d last_rotation = Eigen::Matrix3d::Identity();
  for (int tick = 0; tick < num_ticks; ++tick) {
    const double t = TickAt(tick).time;
    Eigen::Vector3d com = start.com;
    if (!both) com.head<2>() += lean * (foot - start.com).head<2>();
    com += Eigen::Vector3d(0.015 * std::sin(2.1 * t), 0.02 * std::sin(1.7 * t),
                           0.015 * (std::cos(1.3 * t) - 1));
    const Eigen::Matrix3d body =
        (Eigen::AngleAxisd(0.05 * std::sin(1.1 * t), Eigen::Vector3d::UnitX()) *
         Eigen::AngleAxisd(0.05 * std::sin(0.9 * t), Eigen::Vector3d::UnitY()))
            .toRotationMatrix() *
        start.body_rotation[b];
    auto sole = std::array{start.foot_pose[0], start.foot_pose[1]};
    if (!both) {
      sole[1].translation() +=
          Eigen::Vector3d(0.03 * std::sin(1.9 * t), 0.0, 0.02 + 0.02 * (1 - std::cos(2.3 * t)));
    }
    if (!Solve(model, com, body, sole, &state)) return {};
    const robot::RobotData data = robot::Evaluate(model, state);
    const robot::ImuModel& imu = model.imu();
    const Eigen::Matrix3d rotation =
        data.body_rotation[static_cast<size_t>(imu.body)] * imu.pose.linear();
    if (tick == 0) last_rotation = rotation;

    robot_sensors_t& out = sensors[static_cast<size_t>(tick)];
    MessageTraits<robot_sensors_t>::Resize(out, std::array{model.num_joints(), 2});
    std::copy_n(state.joint_position.data(), model.num_joints(), out.joint_position.begin());
    const Eigen::AngleAxisd turn(last_rotation.transpose() * rotation);
    const Eigen::Vector3d gyro = turn.angle() * turn.axis() / (1e-6 * kTickMicroseconds);
    const Eigen::Vector3d force = rotation.transpose() * Eigen::Vector3d(0, 0, robot::kGravity);
    std::copy_n(gyro.data(), 3, out.imu_angular_velocity);
    std::copy_n(force.data(), 3, out.imu_acceleration);
    const double right = both ? std::clamp(0.5 - com.y() / 0.2, 0.2, 0.8) : 1.0;
    out.foot_wrench[0].force[2] = -right * weight;
    out.foot_wrench[1].force[2] = -(1 - right) * weight;
    last_rotation = rotation;
  }
  return sensors;
}

}  // namespace

std::vector<robot_sensors_t> SwayingSensors(const robot::RobotModel& model,
                                            const Contacts& in_contact, int num_ticks) {
  for (const double lean : {1.0, 0.75, 0.5, 0.25, 0.0}) {
    auto sensors = Sway(model, in_contact, num_ticks, lean);
    if (!sensors.empty()) return sensors;
  }
  throw std::logic_error("the robot cannot sway as these tests ask of it");
}

ControlTick::ControlTick(const std::string& robot_path, const Contacts& in_contact,
                         const std::string& redistributor)
    : context_(robot_path),
      estimator_(&context_, ""),
      planner_(&context_, std::string("phase { support: ") +
                              (in_contact[0] && in_contact[1] ? "DOUBLE" : "RIGHT") + " }"),
      task_(&context_, TaskControllerText()),
      monitor_(&context_, MonitorConfig(true)),
      redistributor_(&context_, RedistributorText(redistributor)),
      whole_body_(context_.shared()->Get<balance::WholeBody>(
          "estimated", [] { return std::shared_ptr<balance::WholeBody>(); })) {
  planner_.Bind("robot_state", &state());
  task_.Bind("robot_state", &state());
  task_.Bind("support_plan", &plan());
  monitor_.Bind("robot_state", &state());
  monitor_.Bind("support_plan", &plan());
  monitor_.Bind("task_torque", &task());
  redistributor_.Bind("robot_state", &state());
  redistributor_.Bind("support_plan", &plan());
  redistributor_.Bind("balance_torque", &balance());
}

void ControlTick::Estimate(const robot_sensors_t& sensors, const Tick& tick) {
  estimator_.Bind("robot_sensors", &sensors);
  estimator_.Run(tick);
}

}  // namespace poise
