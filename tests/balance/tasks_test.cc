// Each type of task against finite differences of the motion that it is about.
#include <gtest/gtest.h>

#include <stdexcept>

#include "components/balance/tasks/centroidal_momentum.h"
#include "components/balance/tasks/frame_kinematics.h"
#include "components/balance/tasks/task.h"
#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

VectorXd Velocity(const robot::RobotState& state) {
  VectorXd v(6 + state.joint_velocity.size());
  v << state.base_linear_velocity, state.base_angular_velocity, state.joint_velocity;
  return v;
}

/// After `time` with the velocity and a constant acceleration, to second order.
robot::RobotState After(const robot::RobotState& state, const VectorXd& acceleration, double time) {
  robot::RobotState moved = state;
  const VectorXd shift = time * Velocity(state) + 0.5 * time * time * acceleration;
  moved.base_position += shift.head<3>();
  const Vector3d turn = shift.segment<3>(3);
  moved.base_orientation = Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) *
                           state.base_orientation;
  moved.joint_position += shift.tail(state.joint_position.size());
  moved.base_linear_velocity += time * acceleration.head<3>();
  moved.base_angular_velocity += time * acceleration.segment<3>(3);
  moved.joint_velocity += time * acceleration.tail(state.joint_position.size());
  return moved;
}

TaskSpec Spec(const std::string& type) {
  TaskSpec spec;
  spec.type = type;
  return spec;
}

/// What a task controls at a state, its rate.
VectorXd Rate(const Task& task, const robot::RobotModel& model, const robot::RobotState& state) {
  const robot::RobotData data = Evaluate(model, state);
  VectorXd bias = VectorXd::Zero(task.num_rows()), wanted = bias;
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(task.num_rows(), model.num_velocities());
  TaskRows rows{jacobian, bias, wanted};
  TaskTarget target;
  task.Hold({model, state, data}, &target);
  task.Write({model, state, data}, target, &rows);
  return jacobian * Velocity(state);
}

std::vector<TaskSpec> AllTypes(const std::string& link) {
  std::vector<TaskSpec> specs{Spec("com"),   Spec("orientation"),   Spec("frame"),
                              Spec("frame"), Spec("joint_posture"), Spec("angular_momentum")};
  specs[1].link = link;
  specs[2].link = link;
  specs[2].point = Vector3d(0.1, -0.2, 0.3);
  specs[3].foot = robot::Foot::kLeft;
  return specs;
}

// J q̈ + J̇ q̇ is the rate of J q̇, and J q̇ the rate of what the target names.
TEST(Tasks, RowsAreTheDerivativesOfTheMotion) {
  constexpr double kStep = 1e-5;
  const struct {
    std::shared_ptr<const robot::RobotModel> model;
    const char* link;
  } kRobots[] = {{Biped(), "right_foot"}, {Humanoid(), "camera"}};
  for (const auto& [model, link] : kRobots) {
    StateSampler sampler(model, 31);
    for (int i = 0; i < 20; ++i) {
      const robot::RobotState state = sampler.Draw();
      const VectorXd acceleration = sampler.Vector(model->num_velocities(), 3);
      const robot::RobotData data = Evaluate(*model, state);
      for (const TaskSpec& spec : AllTypes(model->FindFrame(link) != nullptr ? link : "")) {
        const auto task = CreateTask(spec, *model);
        VectorXd bias = VectorXd::Zero(task->num_rows()), wanted = bias;
        Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(task->num_rows(), model->num_velocities());
        TaskRows rows{jacobian, bias, wanted};
        TaskTarget target;
        task->Hold({*model, state, data}, &target);
        task->Write({*model, state, data}, target, &rows);
        const VectorXd ahead = Rate(*task, *model, After(state, acceleration, kStep));
        const VectorXd behind = Rate(*task, *model, After(state, acceleration, -kStep));
        EXPECT_LT((jacobian * acceleration + bias - (ahead - behind) / (2 * kStep)).norm(),
                  1e-6 * (1 + bias.norm() + jacobian.norm()))
            << spec.type;
      }
    }
  }
}

// Held where it is, a task asks for no more than to stop; off its target, for what brings it back.
TEST(Tasks, GainsActOnTheErrorAndItsRate) {
  const auto model = Humanoid();
  StateSampler sampler(model, 32);
  const robot::RobotState state = sampler.Draw();
  for (const TaskSpec& spec : AllTypes("camera")) {
    const auto task = CreateTask(spec, *model);
    const TaskGains gains{.kp = task->needs().angular_momentum ? 0.0 : 100.0, .kd = 7};
    task->set_gains(gains);
    // 1 ms earlier at the same velocity: the target.
    const robot::RobotState before = After(state, VectorXd::Zero(model->num_velocities()), -1e-4);
    TaskTarget target;
    const robot::RobotData then = Evaluate(*model, before), now = Evaluate(*model, state);
    task->Hold({*model, before, then}, &target);
    target.angular_momentum.setZero();
    VectorXd bias = VectorXd::Zero(task->num_rows()), wanted = bias;
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(task->num_rows(), model->num_velocities());
    TaskRows rows{jacobian, bias, wanted};
    task->Write({*model, state, now}, target, &rows);
    const VectorXd rate = jacobian * Velocity(state);
    EXPECT_LT((wanted + (gains.kp * 1e-4 + gains.kd) * rate).norm(), 2e-3 * (1 + rate.norm()))
        << spec.type;
  }
}

TEST(Tasks, AxesSelectRows) {
  const auto model = Humanoid();
  StateSampler sampler(model, 33);
  const robot::RobotState state = sampler.Draw();
  const robot::RobotData data = Evaluate(*model, state);
  const auto rows_of = [&](const TaskSpec& spec) {
    const auto task = CreateTask(spec, *model);
    VectorXd bias = VectorXd::Zero(task->num_rows()), wanted = bias;
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(task->num_rows(), model->num_velocities());
    TaskRows rows{jacobian, bias, wanted};
    TaskTarget target;
    task->Hold({*model, state, data}, &target);
    task->Write({*model, state, data}, target, &rows);
    return jacobian;
  };
  TaskSpec frame = Spec("frame");
  frame.link = "camera";
  const Eigen::MatrixXd all = rows_of(frame);
  ASSERT_EQ(all.rows(), 6);
  frame.axes = {false, true, false, false, false, true};
  const Eigen::MatrixXd some = rows_of(frame);
  ASSERT_EQ(some.rows(), 2);
  EXPECT_EQ(some.row(0), all.row(1));
  EXPECT_EQ(some.row(1), all.row(5));
  TaskSpec posture = Spec("joint_posture");
  posture.joints = {"left_knee"};
  const Eigen::MatrixXd knee = rows_of(posture);
  ASSERT_EQ(knee.rows(), 1);
  EXPECT_EQ(knee(0, 6 + model->FindJoint("left_knee")), 1);
  EXPECT_EQ(knee.squaredNorm(), 1);
}

// Summed over the bodies, and by Newton's and Euler's laws.
TEST(Tasks, AngularMomentumIsThatOfTheBodies) {
  for (const auto& model : {Biped(), Humanoid()}) {
    StateSampler sampler(model, 34);
    for (int i = 0; i < 20; ++i) {
      const robot::RobotState state = sampler.Draw();
      const robot::RobotData data = Evaluate(*model, state);
      Vector3d sum = Vector3d::Zero();
      for (size_t b = 0; b < model->bodies().size(); ++b) {
        const robot::Body& body = model->bodies()[b];
        const Eigen::Matrix3d& r = data.body_rotation[b];
        const Vector3d arm = r * body.com;
        const Vector3d& w = data.body_angular_velocity[b];
        const Vector3d com = data.base_position + data.body_position[b] + arm;
        const Vector3d velocity = data.body_linear_velocity[b] + w.cross(arm);
        sum += (com - data.com).cross(body.mass * (velocity - data.com_velocity)) +
               r * (body.inertia * (r.transpose() * w));
      }
      EXPECT_LT((AngularMomentum(state, data) - sum).norm(), 1e-10 * (1 + sum.norm()));

      Eigen::MatrixXd jacobian(3, model->num_velocities());
      Vector3d bias;
      ComputeAngularMomentumRows(data, jacobian, &bias);
      const VectorXd acceleration = sampler.Vector(model->num_velocities(), 3);
      VectorXd force(model->num_velocities());
      robot::InverseDynamics(*model, state, data, acceleration, force);
      // About the COM gravity has no moment.
      const Vector3d arm = data.com - data.base_position;
      const Vector3d rate = force.segment<3>(3) - arm.cross(force.head<3>());
      EXPECT_LT((jacobian * acceleration + bias - rate).norm(), 1e-9 * (1 + rate.norm()));
    }
  }
}

TEST(Tasks, AWrongSpecificationIsRefusedByName) {
  const auto model = Humanoid();
  const auto refusal = [&](const TaskSpec& spec) -> std::string {
    try {
      CreateTask(spec, *model);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_EQ(refusal(Spec("com")), "taken");
  EXPECT_EQ(refusal(Spec("comm")),
            "type: there is no task 'comm': use one of angular_momentum, com, frame, "
            "joint_posture, orientation");
  TaskSpec spec = Spec("com");
  spec.axes[kTurnY] = true;
  EXPECT_EQ(refusal(spec), "axis: this task has no TURN_Y");
  spec = Spec("frame");
  spec.link = "tail";
  EXPECT_EQ(refusal(spec), "link: robot 'mantis' has no link 'tail'");
  spec.foot = robot::Foot::kRight;
  EXPECT_EQ(refusal(spec), "link: stands beside foot; give one");
  spec = Spec("joint_posture");
  spec.joints = {"left_knee", "tail"};
  EXPECT_EQ(refusal(spec), "joint: robot 'mantis' has no joint 'tail'");
  spec = Spec("angular_momentum");
  spec.foot = robot::Foot::kLeft;
  EXPECT_EQ(refusal(spec), "foot: this task has none");
  spec = Spec("orientation");
  spec.point.x() = 1;
  EXPECT_EQ(refusal(spec), "point: this task has none");
  spec = Spec("com");
  spec.joints = {"left_knee"};
  EXPECT_EQ(refusal(spec), "joint: this task has none");
}

}  // namespace
}  // namespace poise::balance
