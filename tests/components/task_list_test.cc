// Lists of tasks: priorities against the equations of motion and against the conditions that make
// a motion the best of its level, references, and what is refused.
#include "components/task_controller/task_list.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "components/balance/gains/gain_rule.h"
#include "components/messages/motion.h"
#include "components/task_controller/task_controller.h"
#include "tests/components/control_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using robot::TestRobot;

/// Angular momentum about the COM, summed over the bodies.
Vector3d SummedMomentum(const robot::RobotModel& model, const robot::RobotData& data) {
  Vector3d sum = Vector3d::Zero();
  for (size_t b = 0; b < model.bodies().size(); ++b) {
    const robot::Body& body = model.bodies()[b];
    const Eigen::Matrix3d& r = data.body_rotation[b];
    const Vector3d &w = data.body_angular_velocity[b], arm = r * body.com;
    const Vector3d com = data.base_position + data.body_position[b] + arm;
    const Vector3d velocity = data.body_linear_velocity[b] + w.cross(arm);
    sum += (com - data.com).cross(body.mass * (velocity - data.com_velocity)) +
           r * (body.inertia * (r.transpose() * w));
  }
  return sum;
}

/// Its rows: what each velocity alone makes.
MatrixXd MomentumRows(const robot::RobotModel& model, robot::RobotState state) {
  MatrixXd rows(3, model.num_velocities());
  for (Index j = 0; j < rows.cols(); ++j) {
    robot::SetVelocity(VectorXd::Unit(rows.cols(), j), &state);
    rows.col(j) = SummedMomentum(model, robot::Evaluate(model, state));
  }
  return rows;
}

/// Its rate, by Newton and Euler: the moment of what acts on the soles.
Vector3d MomentumRate(const Dynamics& dynamics, const VectorXd& wrench,
                      const Contacts& in_contact) {
  Vector3d rate = Vector3d::Zero();
  Index row = 0;
  for (size_t i = 0; i < 2; ++i) {
    if (!in_contact[i]) continue;
    const Eigen::Isometry3d& sole = dynamics.data.foot_pose[i];
    const Vector3d force = sole.linear() * wrench.segment<3>(row);
    rate -= (sole.translation() - dynamics.data.com).cross(force) +
            sole.linear() * wrench.segment<3>(row + 3);
    row += 6;
  }
  return rate;
}

/// A level's rows, what its motion is (J q̈ + J̇ q̇), and what was asked for.
struct Level {
  MatrixXd rows;
  VectorXd got, wanted;
};

MatrixXd Stacked(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd both(a.rows() + b.rows(), b.cols());
  both << a, b;
  return both;
}

/// The acceleration along each row that a unit force along it gives: its inverse effective mass.
VectorXd Mobility(const Dynamics& dynamics, const MatrixXd& rows) {
  const Index n = rows.cols(), m = dynamics.contact_jacobian.rows();
  MatrixXd system = MatrixXd::Zero(n + m, n + m);
  system.topLeftCorner(n, n) = dynamics.data.mass_matrix;
  system.topRightCorner(n, m) = dynamics.contact_jacobian.transpose();
  system.bottomLeftCorner(m, n) = dynamics.contact_jacobian;
  MatrixXd right = MatrixXd::Zero(n + m, rows.rows());
  right.topRows(n) = rows.transpose();
  const MatrixXd motion = system.fullPivLu().solve(right).topRows(n);
  return (rows * motion).diagonal();
}

/// Each level's error must have no slope along any motion that the contacts and the levels before
/// leave: then it is the least. Returns the largest slope, of rows scaled to unit mobility.
double LargestSlope(const Dynamics& dynamics, const std::vector<Level>& levels) {
  MatrixXd above = dynamics.contact_jacobian;
  double largest = 0;
  for (const Level& level : levels) {
    const Eigen::CompleteOrthogonalDecomposition<MatrixXd> taken(above.transpose());
    const MatrixXd q = taken.householderQ();
    const MatrixXd free = q.rightCols(above.cols() - taken.rank());
    const VectorXd weight = Mobility(dynamics, level.rows).cwiseInverse();
    const VectorXd slope = free.transpose() * level.rows.transpose() * weight.asDiagonal() *
                           (level.got - level.wanted);
    if (slope.size() > 0) largest = std::max(largest, slope.cwiseAbs().maxCoeff());
    above = Stacked(above, level.rows);
  }
  return largest;
}

robot::Matrix6X BodyJacobian(const robot::RobotModel& model, const robot::RobotData& data,
                             int body) {
  robot::Matrix6X jacobian = robot::Matrix6X::Zero(6, model.num_velocities());
  robot::ComputePointJacobian(model, data, body, Vector3d::Zero(), jacobian);
  return jacobian;
}

class TaskListCase : public testing::TestWithParam<Contacts> {};

// Legs alone, three levels: COM and the free foot, angular momentum about x and y, the body's
// orientation, which gets what is left.
TEST_P(TaskListCase, ThreeLevelsOfARobotWithoutArms) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<TaskController> harness(
      &context,
      "com { kp: 225 kd: 10 } orientation { kp: 150 kd: 20 } foot { kp: 100 kd: 15 }"
      "task { type: 'orientation' level: 2 }"
      "task { type: 'com' } task { type: 'frame' foot: RIGHT } task { type: 'frame' foot: LEFT }"
      "task { type: 'angular_momentum' level: 1 axis: TURN_X axis: TURN_Y gains { kd: 9 } }");
  const robot::RobotState standing = StandingState(model);
  std::mt19937 random{TestSeed(31)};
  const auto body = static_cast<size_t>(model.body_task_body());
  const robot::RobotData goal = robot::Evaluate(model, standing);
  const support_plan_t plan = HoldAt(model, goal, GetParam());
  harness.Bind("support_plan", &plan);
  Vector3d held;
  double worst = 0, slope = 0, least_conflict = 1e9;
  for (int trial = 0; trial < 50; ++trial) {
    const robot::RobotState now = Disturbed(standing, 0.05, 0.5, &random);
    const robot_state_t message = StateMessage(model, now);
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(trial));
    const auto& out = harness.output<task_torque_t>();
    ASSERT_EQ(out.status, task_torque_t::STATUS_OK);
    const Dynamics dynamics(model, now, GetParam());
    const robot::RobotData& d = dynamics.data;
    VectorXd acceleration, wrench;
    dynamics.Forward(ToEigen(out.torque), &acceleration, &wrench);
    const Vector3d momentum = SummedMomentum(model, d);
    if (trial == 0) held = momentum;

    std::vector<Level> levels(3);
    levels[0] = {d.com_jacobian, d.com_jacobian * acceleration + d.com_bias_acceleration,
                 225 * (goal.com - d.com) - 10 * d.com_velocity};
    for (size_t i = 0; i < 2; ++i) {
      if (GetParam()[i]) continue;
      const Eigen::Isometry3d &from = d.foot_pose[i], &to = goal.foot_pose[i];
      const Eigen::AngleAxisd turn(to.linear() * from.linear().transpose());
      const Vector3d way = to.translation() - from.translation(),
                     rotation = turn.angle() * turn.axis();
      const VectorXd wanted = 100 * Stacked(way, rotation) - 15 * d.foot_velocity[i];
      const VectorXd got = d.foot_jacobian[i] * acceleration + d.foot_bias_acceleration[i];
      Level& level = levels[0];
      level.rows = Stacked(level.rows, d.foot_jacobian[i]);
      level.got = Stacked(level.got, got);
      level.wanted = Stacked(level.wanted, wanted);
    }
    levels[1] = {MomentumRows(model, now).topRows<2>(),
                 MomentumRate(dynamics, wrench, GetParam()).head<2>(),
                 9 * (held - momentum).head<2>()};
    const robot::Matrix6X jacobian = BodyJacobian(model, d, static_cast<int>(body));
    const Eigen::AngleAxisd turn(goal.body_rotation[body] * d.body_rotation[body].transpose());
    levels[2] = {jacobian.bottomRows<3>(),
                 jacobian.bottomRows<3>() * acceleration + d.body_angular_bias[body],
                 150 * turn.angle() * turn.axis() - 20 * d.body_angular_velocity[body]};
    for (size_t l : {0, 1}) {
      worst = std::max(worst, (levels[l].got - levels[l].wanted).cwiseAbs().maxCoeff());
    }
    slope = std::max(slope, LargestSlope(dynamics, levels));
    least_conflict = std::min(least_conflict, (levels[2].got - levels[2].wanted).norm());
  }
  EXPECT_LT(worst, 1e-8);
  EXPECT_LT(slope, 1e-7);
  EXPECT_GT(least_conflict, 1e-3) << "the levels were never in conflict";
  RecordProperty("worst_residual", testing::PrintToString(worst));
  RecordProperty("largest_slope", testing::PrintToString(slope));
}

// A hand on the second level, the joints' posture on the third.
TEST_P(TaskListCase, ThreeLevelsOfARobotWithAHand) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kMantis);
  ControlContext context(TestRobot::kMantis);
  Harness<TaskController> harness(
      &context,
      TaskControllerText() +
          "joint_limits: false "  // states are drawn, some beyond what a joint can stop from
          "task { type: 'com' } task { type: 'orientation' }"
          "task { type: 'frame' foot: RIGHT } task { type: 'frame' foot: LEFT }"
          "task { type: 'frame' link: 'right_forearm' axis: X axis: Y axis: Z level: 1"
          "       gains { kp: 64 kd: 16 } point { x: 0.1 z: -0.2 } }"
          "task { type: 'joint_posture' level: 2 gains { kp: 80 kd: 12 } }");
  const robot::Frame& hand = *model.FindFrame("right_forearm");
  const Vector3d point = hand.pose * Vector3d(0.1, 0, -0.2);
  const auto place = [&](const robot::RobotData& d) -> Vector3d {
    const auto b = static_cast<size_t>(hand.body);
    return d.base_position + d.body_position[b] + d.body_rotation[b] * point;
  };
  const robot::RobotState standing = StandingState(model);
  std::mt19937 random{TestSeed(32)};
  const robot::RobotData goal = robot::Evaluate(model, standing);
  const support_plan_t plan = HoldAt(model, goal, GetParam());
  harness.Bind("support_plan", &plan);
  Vector3d held;
  VectorXd posture;
  double worst = 0, slope = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const robot::RobotState now = Disturbed(standing, 0.05, 0.5, &random);
    const robot_state_t message = StateMessage(model, now);
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(trial));
    ASSERT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK);
    const Dynamics dynamics(model, now, GetParam());
    const robot::RobotData& d = dynamics.data;
    VectorXd acceleration, wrench;
    dynamics.Forward(ToEigen(harness.output<task_torque_t>().torque), &acceleration, &wrench);
    if (trial == 0) {
      held = place(d);
      posture = now.joint_position;
    }
    robot::Matrix6X jacobian = robot::Matrix6X::Zero(6, model.num_velocities());
    robot::ComputePointJacobian(model, d, hand.body, point, jacobian);
    const MatrixXd reach = jacobian.topRows<3>();
    // The point's acceleration from where it is along the motion, a little later and earlier.
    constexpr double kStep = 1e-4;
    const VectorXd velocity = robot::Velocity(now);
    const auto after = [&](double time) {
      return place(
          robot::Evaluate(model, robot::Moved(now, velocity + 0.5 * time * acceleration, time)));
    };
    const Vector3d got = (after(kStep) - 2 * after(0) + after(-kStep)) / (kStep * kStep);
    const Vector3d wanted = 64 * (held - place(d)) - 16 * reach * velocity;
    worst = std::max(worst, (got - wanted).cwiseAbs().maxCoeff());

    const auto b = static_cast<size_t>(model.body_task_body());
    MatrixXd first = Stacked(MatrixXd(d.com_jacobian),
                             MatrixXd(BodyJacobian(model, d, static_cast<int>(b)).bottomRows<3>()));
    for (size_t i = 0; i < 2; ++i) {
      if (!GetParam()[i]) first = Stacked(first, d.foot_jacobian[i]);
    }
    const VectorXd none = VectorXd::Zero(first.rows());
    const Index k = model.num_joints();
    MatrixXd joints = MatrixXd::Zero(k, k + 6);
    joints.rightCols(k).setIdentity();
    slope = std::max(
        slope,
        LargestSlope(dynamics, {{first, none, none},
                                {reach, Vector3d::Zero(), Vector3d::Zero()},
                                {joints, acceleration.tail(k),
                                 80 * (posture - now.joint_position) - 12 * now.joint_velocity}}));
  }
  EXPECT_LT(worst, 1e-4);  // of the second difference
  EXPECT_LT(slope, 1e-7);
  RecordProperty("largest_slope", testing::PrintToString(slope));
}

INSTANTIATE_TEST_SUITE_P(All, TaskListCase,
                         testing::Values(Contacts{true, true}, Contacts{true, false},
                                         Contacts{false, true}),
                         [](const testing::TestParamInfo<Contacts>& info) {
                           return info.param[0] && info.param[1] ? "Double"
                                  : info.param[0]                ? "Right"
                                                                 : "Left";
                         });

/// Torques of `config` over a few states, the plan away from where the robot is.
std::vector<std::vector<double>> Torques(TestRobot robot, const std::string& config,
                                         const Contacts& in_contact, double com_ahead = 0.02) {
  const robot::RobotModel model = robot::LoadTestRobot(robot);
  ControlContext context(robot);
  Harness<TaskController> harness(&context, config);
  const robot::RobotState standing = StandingState(model);
  support_plan_t plan = HoldAt(model, robot::Evaluate(model, standing), in_contact);
  plan.com_reference.position[0] += com_ahead;
  harness.Bind("support_plan", &plan);
  std::mt19937 random{7};
  std::vector<std::vector<double>> torques;
  for (int trial = 0; trial < 10; ++trial) {
    const robot_state_t message = StateMessage(model, Disturbed(standing, 0.05, 0.5, &random));
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(trial));
    EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK);
    torques.push_back(harness.output<task_torque_t>().torque);
  }
  return torques;
}

// Joint velocities come late. In a step the foot in the air is damped by what it moves at now, were
// it accelerated as its reference.
TEST(TaskList, AThrownFootIsDampedByNoLateVelocity) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const double kd = 15, delay = balance::VelocityDelay(model, balance::StepCutoff(model));
  ASSERT_GT(delay, 0.003);
  ControlContext context(TestRobot::kDyros);
  Harness<TaskController> harness(&context, "foot { kp: 100 kd: 15 } joint_limits: false");
  const Contacts contacts{true, false};
  std::mt19937 random{TestSeed(41)};
  std::bernoulli_distribution forwards;
  for (int trial = 0; trial < 30; ++trial) {
    robot::RobotState now = Disturbed(StandingState(model), 0.05, 0, &random);
    robot::RobotState late = now;
    VectorXd acceleration = VectorXd::Zero(model.num_velocities());
    for (const int j : model.supporting_joints(model.feet()[1].body)) {
      const double side = forwards(random) ? 1 : -1;
      acceleration[6 + j] = side * 60;
      now.joint_velocity[j] = side * 3;
      late.joint_velocity[j] = now.joint_velocity[j] - delay * acceleration[6 + j];
    }
    const robot::RobotData is = robot::Evaluate(model, now);
    const PointMotion reference{
        is.foot_pose[1].translation(), is.foot_velocity[1].head<3>(),
        is.foot_jacobian[1].topRows<3>() * acceleration + is.foot_bias_acceleration[1].head<3>()};
    const Dynamics dynamics(model, late, contacts);
    const robot_state_t message = StateMessage(model, late);
    harness.Bind("robot_state", &message);
    const Vector3d unforeseen =
        kd * (reference.velocity - dynamics.data.foot_velocity[1].head<3>());
    ASSERT_GT(unforeseen.norm(), 1);  // m/s²
    for (const bool steps : {false, true}) {
      support_plan_t plan = HoldAt(model, is, contacts);
      plan.com_follows = steps ? support_plan_t::FOLLOWS_COP : support_plan_t::FOLLOWS_REFERENCE;
      SetMotion(reference, &plan.foot_reference[1]);
      harness.Bind("support_plan", &plan);
      harness.Run(TickAt(2 * trial + (steps ? 1 : 0)));
      const auto& out = harness.output<task_torque_t>();
      ASSERT_EQ(out.status, task_torque_t::STATUS_OK);
      VectorXd given, wrench;
      dynamics.Forward(ToEigen(out.torque), &given, &wrench);
      const Vector3d got = (dynamics.data.foot_jacobian[1] * given).head<3>() +
                           dynamics.data.foot_bias_acceleration[1].head<3>() -
                           reference.acceleration;
      // In a step what J̇ changes by in the delay is left, of second order.
      EXPECT_LT((got - (steps ? Vector3d(Vector3d::Zero()) : unforeseen)).norm(),
                steps ? 0.3 * unforeseen.norm() : 1e-6);
    }
  }
}

TEST(TaskList, WithoutAListThereAreThePapersTasks) {
  const std::string list =
      "task { type: 'com' } task { type: 'orientation' reference: BODY }"
      "task { type: 'frame' foot: RIGHT } task { type: 'frame' foot: LEFT gains { kp: 100 kd: 15 } "
      "}";
  // The robot has legs alone: other joints hold their posture without a list.
  for (const Contacts& feet : {Contacts{true, true}, {true, false}, {false, true}}) {
    EXPECT_EQ(Torques(TestRobot::kDyros, TaskControllerText(), feet),
              Torques(TestRobot::kDyros, TaskControllerText() + list, feet));
  }
}

// A task that follows START is where it was, whatever the plan says; and what it holds is part of
// the controller's state.
TEST(TaskList, TheStartIsHeld) {
  const std::string list =
      "task { type: 'orientation' link: 'camera' reference: BODY }"
      "task { type: 'frame' foot: RIGHT } task { type: 'frame' foot: LEFT } task { type: 'com' ";
  const Contacts both{true, true};
  const std::string plan = TaskControllerText() + list + "}";
  const std::string start =
      TaskControllerText() + list + "reference: START gains { kp: 9 kd: 9 } }";
  EXPECT_NE(Torques(TestRobot::kMantis, plan, both), Torques(TestRobot::kMantis, plan, both, 0.05));
  EXPECT_EQ(Torques(TestRobot::kMantis, start, both),
            Torques(TestRobot::kMantis, start, both, 0.05));

  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kMantis);
  ControlContext context(TestRobot::kMantis);
  const robot::RobotState standing = StandingState(model);
  const support_plan_t message = HoldAt(model, robot::Evaluate(model, standing), both);
  std::mt19937 random{TestSeed(33)};
  std::array<robot_state_t, 2> states;
  for (robot_state_t& state : states) {
    state = StateMessage(model, Disturbed(standing, 0.05, 0.5, &random));
  }
  Harness<TaskController> first(&context, start), second(&context, start);
  for (auto* harness : {&first, &second}) {
    harness->Bind("support_plan", &message);
    harness->Bind("robot_state", &states[harness == &first ? 0 : 1]);
    harness->Run(TickAt(0));
  }
  second.Restore(first.Save());
  for (auto* harness : {&first, &second}) {
    harness->Bind("robot_state", &states[1]);
    harness->Run(TickAt(1));
  }
  EXPECT_EQ(first.output<task_torque_t>().torque, second.output<task_torque_t>().torque);
}

TEST(TaskList, RefusesByTheNameOfTheField) {
  const auto refusal = [](TestRobot robot, const std::string& list) -> std::string {
    ControlContext context(robot);
    try {
      Harness<TaskController> harness(&context, list);
    } catch (const ConfigError& error) {
      return error.field();
    }
    return "accepted";
  };
  const std::string gains = TaskControllerText();
  const auto legs = [&](const std::string& task) {
    return refusal(TestRobot::kDyros, gains + "task { type: 'com' } task { " + task + " }");
  };
  EXPECT_EQ(legs("type: 'orientation'"), "accepted");
  EXPECT_EQ(legs("type: 'comm'"), "task[1].type");
  EXPECT_EQ(legs("type: 'orientation' level: -1"), "task[1].level");
  EXPECT_EQ(legs("type: 'orientation' axis: X"), "task[1].axis");
  EXPECT_EQ(legs("type: 'orientation' link: 'tail'"), "task[1].link");
  EXPECT_EQ(legs("type: 'orientation' link: 'right_foot'"), "accepted");  // gains by rule
  EXPECT_EQ(legs("type: 'orientation' gains { kp: 1 kd: -1 }"), "task[1].gains.kd");
  EXPECT_EQ(legs("type: 'orientation' gains { kd: 1 }"), "task[1].gains.kp");
  EXPECT_EQ(legs("type: 'orientation' reference: COM"), "task[1].reference");
  EXPECT_EQ(legs("type: 'orientation' point { x: 1 }"), "task[1].point");
  EXPECT_EQ(legs("type: 'orientation' joint: 'right_knee_pitch'"), "task[1].joint");
  EXPECT_EQ(legs("type: 'frame' foot: LEFT link: 'right_foot'"), "task[1].link");
  EXPECT_EQ(legs("type: 'frame' foot: LEFT reference: BODY"), "task[1].reference");
  EXPECT_EQ(legs("type: 'frame' point { x: inf } gains { kp: 1 kd: 1 }"), "task[1].point.x");
  EXPECT_EQ(legs("type: 'angular_momentum' gains { kp: 1 kd: 1 }"), "task[1].gains.kp");
  EXPECT_EQ(legs("type: 'angular_momentum' gains { kd: 1 } foot: LEFT"), "task[1].foot");
  EXPECT_EQ(legs("type: 'joint_posture' gains { kp: 1 kd: 1 } joint: 'tail'"), "task[1].joint");
  EXPECT_EQ(legs("type: 'com' link: 'right_foot'"), "task[1].link");
  // More than twelve joints can do at once; nothing to do on two feet; joints left to the posture.
  EXPECT_EQ(legs("type: 'joint_posture' gains { kp: 1 kd: 1 }"), "task");
  EXPECT_EQ(legs("type: 'joint_posture' level: 1 gains { kp: 1 kd: 1 }"), "accepted");
  EXPECT_EQ(refusal(TestRobot::kDyros, gains + "task { type: 'frame' foot: LEFT }"), "task");
  EXPECT_EQ(refusal(TestRobot::kDyros, "task { type: 'com' gains { kp: 1 kd: 1 } }"), "accepted");
}

}  // namespace
}  // namespace poise
