// The task controller with a faked estimator and planner, against the equations of motion solved
// directly.
#include "components/task_controller/task_controller.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <limits>

#include "components/balance/gains/gain_rule.h"
#include "components/messages/conversions.h"
#include "components/messages/motion.h"
#include "tests/components/control_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using robot::TestRobot;

struct Case {
  TestRobot robot;
  const char* support;
  Contacts in_contact;
};

std::string CaseName(const testing::TestParamInfo<Case>& info) {
  return std::string(info.param.robot == TestRobot::kDyros ? "Dyros" : "Mantis") +
         info.param.support;
}

class TaskControllerCase : public testing::TestWithParam<Case> {
 protected:
  TaskControllerCase()
      : model_(robot::LoadTestRobot(GetParam().robot)),
        context_(GetParam().robot),
        standing_(StandingState(model_)) {}

  robot::RobotModel model_;
  ControlContext context_;
  robot::RobotState standing_;
  std::mt19937 random_{TestSeed(20)};
};

// Rotation vector by the quaternion's logarithm.
Eigen::Vector3d RotationVector(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() *= -1;
  const double s = q.vec().norm();
  return s < 1e-12 ? Eigen::Vector3d(2 * q.vec())
                   : Eigen::Vector3d(2 * std::atan2(s, q.w()) / s * q.vec());
}

Eigen::Vector3d Draw(double size, std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-size, size);
  return Eigen::Vector3d::NullaryExpr([&] { return uniform(*random); });
}

// The motion that the torque gives, solved from the equations of motion, is the motion that was
// asked for: k_p e + k_d ė + ẍ of the COM, of the body and of the free foot, turning too; of a COM
// that follows a centre of pressure ẍ alone.
TEST_P(TaskControllerCase, TheTorqueGivesTheDesiredAccelerations) {
  const auto body = static_cast<size_t>(model_.body_task_body());
  Harness<TaskController> harness(&context_, TaskControllerText());
  // In a step the velocity of a foot in the air is taken for what it is now.
  const double delay = balance::VelocityDelay(model_, balance::StepCutoff(model_));
  double worst = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const robot::RobotState there = Disturbed(standing_, 0.05, 0.3, &random_);
    const robot::RobotState now = Disturbed(there, 0.05, 0.5, &random_);
    const Dynamics goal(model_, there, GetParam().in_contact);
    support_plan_t plan = HoldAt(model_, goal.data, GetParam().in_contact);
    PointMotion com = GetMotion(plan.com_reference);
    RotationMotion turn = GetMotion(plan.body_reference);
    com.velocity = Draw(0.3, &random_);
    com.acceleration = Draw(1, &random_);
    const bool follows_cop = trial % 2 == 1;
    if (follows_cop) {
      plan.com_follows = support_plan_t::FOLLOWS_COP;
      com.position.head<2>().setConstant(std::numeric_limits<double>::quiet_NaN());
      com.velocity.head<2>() = com.position.head<2>();
    }
    turn.angular_velocity = Draw(0.5, &random_);
    turn.angular_acceleration = Draw(2, &random_);
    SetMotion(com, &plan.com_reference);
    SetMotion(turn, &plan.body_reference);
    std::array<PointMotion, 2> foot;
    std::array<RotationMotion, 2> foot_turn;
    for (size_t i = 0; i < 2; ++i) {
      foot[i] = GetMotion(plan.foot_reference[i]);
      foot_turn[i] = GetMotion(plan.foot_rotation_reference[i]);
      foot[i].velocity = Draw(0.3, &random_);
      foot[i].acceleration = Draw(1, &random_);
      foot_turn[i].angular_velocity = Draw(0.5, &random_);
      foot_turn[i].angular_acceleration = Draw(2, &random_);
      SetMotion(foot[i], &plan.foot_reference[i]);
      SetMotion(foot_turn[i], &plan.foot_rotation_reference[i]);
    }
    const robot_state_t message = StateMessage(model_, now);
    harness.Bind("robot_state", &message);
    harness.Bind("support_plan", &plan);
    harness.Run(TickAt(trial));
    const auto& out = harness.output<task_torque_t>();
    ASSERT_EQ(out.status, task_torque_t::STATUS_OK);

    const Dynamics dynamics(model_, now, GetParam().in_contact);
    Eigen::VectorXd acceleration, wrench;
    dynamics.Forward(ToEigen(out.torque), &acceleration, &wrench);
    const robot::RobotData& d = dynamics.data;
    Eigen::Vector3d com_wanted =
        com.acceleration + 225 * (com.position - d.com) + 10 * (com.velocity - d.com_velocity);
    if (follows_cop) com_wanted.head<2>() = com.acceleration.head<2>();
    const Eigen::Vector3d com_got = d.com_jacobian * acceleration + d.com_bias_acceleration;
    const Eigen::Vector3d error =
        RotationVector(goal.data.body_rotation[body] * d.body_rotation[body].transpose());
    const Eigen::Vector3d turn_wanted =
        turn.angular_acceleration + 150 * error +
        20 * (turn.angular_velocity - d.body_angular_velocity[body]);
    robot::Matrix6X jacobian = robot::Matrix6X::Zero(6, model_.num_velocities());
    robot::ComputePointJacobian(model_, d, static_cast<int>(body), Eigen::Vector3d::Zero(),
                                jacobian);
    const Eigen::Vector3d turn_got =
        jacobian.bottomRows<3>() * acceleration + d.body_angular_bias[body];
    worst = std::max({worst, (com_wanted - com_got).norm(), (turn_wanted - turn_got).norm()});
    EXPECT_LT((GetVector3(out.body_orientation_error) - error).norm(), 1e-12);
    for (size_t i = 0; i < 2; ++i) {
      if (GetParam().in_contact[i]) continue;
      const Eigen::Isometry3d &from = d.foot_pose[i], &to = goal.data.foot_pose[i];
      Eigen::VectorXd wanted(6);
      wanted << foot[i].acceleration + 100 * (to.translation() - from.translation()) +
                    15 * foot[i].velocity,
          foot_turn[i].angular_acceleration +
              100 * RotationVector(to.linear() * from.linear().transpose()) +
              15 * foot_turn[i].angular_velocity;
      wanted -= 15 * d.foot_velocity[i];
      if (follows_cop) {
        wanted.head<3>() -=
            15 * delay * (foot[i].acceleration - d.foot_bias_acceleration[i].head<3>());
      }
      const Eigen::VectorXd got = d.foot_jacobian[i] * acceleration + d.foot_bias_acceleration[i];
      worst = std::max(worst, (wanted - got).norm());
    }
  }
  EXPECT_LT(worst, 1e-8);  // m/s², rad/s²
  RecordProperty("worst_residual", testing::PrintToString(worst));
}

TEST_P(TaskControllerCase, GravityCompensationHoldsTheRobotStill) {
  Harness<TaskController> harness(&context_, TaskControllerText());
  support_plan_t plan = HoldAt(model_, robot::Evaluate(model_, standing_), GetParam().in_contact);
  plan.gravity_compensation = 1;
  harness.Bind("support_plan", &plan);
  for (int trial = 0; trial < 50; ++trial) {
    const robot::RobotState now = Disturbed(standing_, 0.1, 0, &random_);
    const robot_state_t message = StateMessage(model_, now);
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(trial));
    const auto& out = harness.output<task_torque_t>();
    ASSERT_EQ(out.status, task_torque_t::STATUS_OK);
    const Dynamics dynamics(model_, now, GetParam().in_contact);
    Eigen::VectorXd acceleration, wrench;
    dynamics.Forward(ToEigen(out.torque), &acceleration, &wrench);
    EXPECT_LT(acceleration.norm(), 1e-8);
    EXPECT_EQ(GetVector3(out.body_orientation_error).norm(), 0);  // no task
  }
}

TEST_P(TaskControllerCase, KeepsTheLastTorqueWhenTheStateIsUnusable) {
  Harness<TaskController> harness(&context_, TaskControllerText());
  support_plan_t plan = HoldAt(model_, robot::Evaluate(model_, standing_), GetParam().in_contact);
  harness.Bind("support_plan", &plan);
  robot_state_t message = StateMessage(model_, standing_);
  harness.Bind("robot_state", &message);
  harness.Run(TickAt(0));
  const std::vector<double> good = harness.output<task_torque_t>().torque;
  ASSERT_GT(ToEigen(good).norm(), 1);

  const auto expect_held = [&](int8_t status) {
    harness.Run(TickAt(1));
    const auto& out = harness.output<task_torque_t>();
    EXPECT_EQ(out.status, status);
    EXPECT_EQ(out.torque, good);
    EXPECT_TRUE(MessageTraits<task_torque_t>::AllFinite(out));
  };
  const robot_state_t sound = message;
  message.joint_velocity[3] = std::numeric_limits<double>::quiet_NaN();
  expect_held(task_torque_t::STATUS_INVALID_STATE);
  message = sound;
  message.base_position[2] = std::numeric_limits<double>::infinity();
  expect_held(task_torque_t::STATUS_INVALID_STATE);
  message = sound;
  for (double& x : message.base_orientation) x = 0;
  expect_held(task_torque_t::STATUS_INVALID_STATE);
  message = sound;
  plan.status = support_plan_t::STATUS_INVALID_STATE;
  expect_held(task_torque_t::STATUS_INVALID_STATE);
  plan.status = support_plan_t::STATUS_WAITING;
  harness.Run(TickAt(2));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK);
}

TEST_P(TaskControllerCase, AGainThatAnOperatorSetsIsThatOfAConfiguration) {
  const std::string body = "orientation { kp: 100 kd: 20 } ";
  Harness<TaskController> live(&context_, "com { kp: 80 kd: 18 } " + body);
  ControlContext other(GetParam().robot);
  Harness<TaskController> configured(&other, "com { kp: 120 kd: 15 } " + body);
  const std::vector<std::pair<std::string, double>> settings = {{"com.kp", 120}, {"com.kd", 15}};
  for (size_t i = 0; i < settings.size(); ++i) {
    const auto& [field, value] = settings[i];
    operate::act_t act{};
    act.id = static_cast<int64_t>(i) + 1;
    act.tick = 5;
    act.kind = operate::act_t::KIND_SETTING;
    std::copy(field.begin(), field.end(), act.field);
    act.value = value;
    live.acts().Offer(act);
  }
  const support_plan_t plan = HoldAt(
      model_, Dynamics(model_, standing_, GetParam().in_contact).data, GetParam().in_contact);
  const robot_state_t state = StateMessage(model_, Disturbed(standing_, 0.02, 0.1, &random_));
  double largest_step = 0, whole_step = 0;
  std::vector<double> last;
  for (int64_t tick = 0; tick < 300; ++tick) {
    for (Harness<TaskController>* each : {&live, &configured}) {
      each->Bind("robot_state", &state);
      each->Bind("support_plan", &plan);
      each->Run(TickAt(tick));
    }
    const std::vector<double>& torque = live.output<task_torque_t>().torque;
    const std::vector<double>& wanted = configured.output<task_torque_t>().torque;
    double difference = 0;
    for (size_t j = 0; j < torque.size(); ++j) {
      difference = std::max(difference, std::abs(torque[j] - wanted[j]));
      if (tick > 0) largest_step = std::max(largest_step, std::abs(torque[j] - last[j]));
    }
    last = torque;
    if (tick == 4) whole_step = difference;
    // 0.5 s after: the same bits.
    if (tick >= 5 + 250) {
      EXPECT_EQ(difference, 0) << tick;
    }
  }
  EXPECT_GT(whole_step, 0);
  // The torque is linear in the gains, which go in a straight line of 250 ticks.
  EXPECT_NEAR(largest_step, whole_step / 250, 1e-6 * whole_step);
}

INSTANTIATE_TEST_SUITE_P(All, TaskControllerCase,
                         testing::Values(Case{TestRobot::kDyros, "DOUBLE", {true, true}},
                                         Case{TestRobot::kDyros, "RIGHT", {true, false}},
                                         Case{TestRobot::kDyros, "LEFT", {false, true}},
                                         Case{TestRobot::kMantis, "DOUBLE", {true, true}},
                                         Case{TestRobot::kMantis, "RIGHT", {true, false}},
                                         Case{TestRobot::kMantis, "LEFT", {false, true}}),
                         CaseName);

// Straight legs: the COM cannot accelerate upwards, the tasks depend on each other.
TEST(TaskController, StraightKneesAreReportedAsSingular) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<TaskController> harness(&context, TaskControllerText());
  const support_plan_t plan =
      HoldAt(model, robot::Evaluate(model, StandingState(model)), {true, true});
  harness.Bind("support_plan", &plan);
  robot_state_t message = StateMessage(model, StandingState(model));
  harness.Bind("robot_state", &message);
  harness.Run(TickAt(0));
  const std::vector<double> good = harness.output<task_torque_t>().torque;
  message = StateMessage(model, robot::RobotState(model.num_joints()));
  harness.Run(TickAt(1));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_SINGULAR);
  EXPECT_EQ(harness.output<task_torque_t>().torque, good);
}

// The joints that the tasks leave free return to their posture instead of falling.
TEST(TaskController, FreeJointsAreHeld) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kMantis);
  ControlContext context(TestRobot::kMantis);
  Harness<TaskController> harness(&context, TaskControllerText());
  const robot::RobotState standing = StandingState(model);
  const support_plan_t plan = HoldAt(model, robot::Evaluate(model, standing), {true, true});
  harness.Bind("support_plan", &plan);
  const robot_state_t message = StateMessage(model, standing);
  harness.Bind("robot_state", &message);
  harness.Run(TickAt(0));
  const Dynamics dynamics(model, standing, {true, true});
  Eigen::VectorXd acceleration, wrench;
  dynamics.Forward(ToEigen(harness.output<task_torque_t>().torque), &acceleration, &wrench);
  EXPECT_LT(acceleration.norm(), 1e-7);
}

// Waist and arms accelerate as their own PD asks, whatever COM, body and feet do: against the
// equations of motion, which know no reduced coordinates.
TEST(TaskController, JointsThatAreNoLegsFollowTheirPosture) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kMantis);
  std::vector<bool> leg(static_cast<size_t>(model.num_joints()));
  for (const robot::FootModel& foot : model.feet()) {
    for (const int j : model.supporting_joints(foot.body)) leg[static_cast<size_t>(j)] = true;
  }
  for (const Contacts& feet : {Contacts{true, true}, {true, false}}) {
    ControlContext context(TestRobot::kMantis);
    Harness<TaskController> harness(&context, TaskControllerText() + "joint_limits: false");
    const robot::RobotState standing = StandingState(model);
    const support_plan_t plan = HoldAt(model, robot::Evaluate(model, standing), feet);
    harness.Bind("support_plan", &plan);
    robot_state_t message = StateMessage(model, standing);
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(0));
    std::mt19937 random{11};
    for (int trial = 1; trial < 10; ++trial) {
      const robot::RobotState state = Disturbed(standing, 0.05, 0.5, &random);
      message = StateMessage(model, state);
      harness.Run(TickAt(trial));
      ASSERT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK);
      const Dynamics dynamics(model, state, feet);
      Eigen::VectorXd acceleration, wrench;
      dynamics.Forward(ToEigen(harness.output<task_torque_t>().torque), &acceleration, &wrench);
      for (int j = 0; j < model.num_joints(); ++j) {
        if (leg[static_cast<size_t>(j)]) continue;
        EXPECT_NEAR(acceleration[6 + j],
                    80 * (standing.joint_position[j] - state.joint_position[j]) -
                        12 * state.joint_velocity[j],
                    1e-7)
            << j;
      }
    }
  }
}

/// Torque of the paper's robot at `state`, with `limits` in its configuration.
Eigen::VectorXd TorqueAt(const robot::RobotModel& model, const support_plan_t& plan,
                         const robot::RobotState& state, const char* limits) {
  ControlContext context(TestRobot::kDyros);
  Harness<TaskController> harness(&context, TaskControllerText() + limits);
  harness.Bind("support_plan", &plan);
  const robot_state_t message = StateMessage(model, state);
  harness.Bind("robot_state", &message);
  harness.Run(TickAt(0));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK);
  return ToEigen(harness.output<task_torque_t>().torque);
}

// A joint that rushes at its limit is stopped where the soles stand, since then the body moves with
// it; where a sole turns with the joint, stopping it by the body would throw the robot over.
TEST(TaskController, ASoleThatTurnsIsNotStoppedByTheBody) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  const int ankle = model.FindJoint("right_ankle_roll");
  ASSERT_GE(ankle, 0);
  const robot::RobotState standing = StandingState(model);
  const robot::RobotData data = robot::Evaluate(model, standing);
  const support_plan_t plan = HoldAt(model, data, {true, true});
  const auto torque = [&](const robot::RobotState& state, const char* limits) {
    return TorqueAt(model, plan, state, limits);
  };
  constexpr double kSpeed = 8;  // rad/s, beyond what can be stopped before the limit
  robot::RobotState state = standing;
  state.joint_velocity[ankle] = kSpeed;
  EXPECT_EQ((torque(state, "") - torque(state, "joint_limits: false")).norm(), 0);

  // The same speed of a motion in which both soles stand still: what is left of the joint alone.
  const int n = model.num_velocities();
  Eigen::MatrixXd feet(12, n);
  feet << data.foot_jacobian[0], data.foot_jacobian[1];
  const Eigen::MatrixXd fixed = Eigen::MatrixXd::Identity(n, n) -
                                feet.completeOrthogonalDecomposition().pseudoInverse() * feet;
  const Eigen::VectorXd motion = fixed.col(6 + ankle) * kSpeed / fixed(6 + ankle, 6 + ankle);
  ASSERT_LT((feet * motion).norm(), 1e-9);
  state.base_linear_velocity = motion.head<3>();
  state.base_angular_velocity = motion.segment<3>(3);
  state.joint_velocity = motion.tail(n - 6);
  EXPECT_GT((torque(state, "") - torque(state, "joint_limits: false")).norm(), 1);
}

/// How the tasks accelerate on the left foot with one knee at 8 rad/s, less how they would with
/// joints that have no limits. That is more than can be stopped before the knee is straight.
struct StoppedKnee {
  explicit StoppedKnee(const char* knee) {
    const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
    const int joint = model.FindJoint(knee);
    robot::RobotState state = StandingState(model);
    const robot::RobotData data = robot::Evaluate(model, state);
    Eigen::VectorXd motion = Eigen::VectorXd::Unit(model.num_velocities(), 6 + joint) * -8;
    // The sole that stands does so while the body moves.
    motion.head<6>() = -data.foot_jacobian[1].leftCols<6>().fullPivLu().solve(
        data.foot_jacobian[1].col(6 + joint) * -8);
    robot::SetVelocity(motion, &state);
    const Contacts left{false, true};
    const support_plan_t plan = HoldAt(model, data, left);
    const Dynamics dynamics(model, state, left);
    const auto acceleration = [&](const char* limits) {
      Eigen::VectorXd q, wrench;
      dynamics.Forward(TorqueAt(model, plan, state, limits), &q, &wrench);
      return q;
    };
    const Eigen::VectorXd change = acceleration("") - acceleration("joint_limits: false");
    of_knee = change[6 + joint];
    com = dynamics.data.com_jacobian * change;
    foot = dynamics.data.foot_jacobian[0] * change;
    Eigen::MatrixXd body = Eigen::MatrixXd::Zero(6, model.num_velocities());
    robot::ComputePointJacobian(model, dynamics.data, model.body_task_body(),
                                Eigen::Vector3d::Zero(), body);
    turn = body.bottomRows<3>() * change;
  }

  double of_knee = 0;  // rad/s²
  Eigen::Vector3d com, turn;
  robot::Vector6d foot;  // the free one
};

TEST(TaskController, ALegThatGetsNoLongerLetsTheComDown) {
  const StoppedKnee stopped("left_knee_pitch");
  EXPECT_GT(stopped.of_knee, 1);
  EXPECT_LT(stopped.com.z(), -1);
  EXPECT_LT(stopped.com.head<2>().norm(), 1e-8);
  EXPECT_LT(stopped.turn.norm(), 1e-8);
  EXPECT_LT(stopped.foot.norm(), 1e-7);
}

TEST(TaskController, AKneeThatIsStoppedLeavesItsFootTheHeight) {
  const StoppedKnee stopped("right_knee_pitch");
  EXPECT_GT(stopped.of_knee, 1);
  EXPECT_LT(std::abs(stopped.foot[2]), 1e-8);
  EXPECT_GT(stopped.foot.norm(), 1);
}

// A quaternion off by less than the message's tolerance gives the torque of its direction; one
// beyond is refused.
TEST(TaskController, NormalisesTheOrientationItAccepts) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<TaskController> harness(&context, TaskControllerText());
  const support_plan_t plan =
      HoldAt(model, robot::Evaluate(model, StandingState(model)), {true, true});
  harness.Bind("support_plan", &plan);
  const robot_state_t exact = StateMessage(model, StandingState(model));
  robot_state_t message = exact;
  harness.Bind("robot_state", &message);
  harness.Run(TickAt(0));
  const Eigen::VectorXd torque = ToEigen(harness.output<task_torque_t>().torque);
  for (const double scale : {1 - 0.9e-6, 1 + 0.9e-6}) {
    for (int i = 0; i < 4; ++i) message.base_orientation[i] = scale * exact.base_orientation[i];
    harness.Run(TickAt(1));
    ASSERT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK);
    EXPECT_LT((ToEigen(harness.output<task_torque_t>().torque) - torque).norm(), 1e-9);
  }
  for (int i = 0; i < 4; ++i) {
    message.base_orientation[i] = (1 + 1.1e-6) * exact.base_orientation[i];
  }
  harness.Run(TickAt(2));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_INVALID_STATE);
}

TEST(TaskController, RefusesGainsThatCannotBe) {
  ControlContext context(TestRobot::kDyros);
  const auto field_of = [&](const std::string& config) -> std::string {
    try {
      Harness<TaskController> harness(&context, config);
    } catch (const ConfigError& error) {
      return error.field();
    }
    return "accepted";
  };
  const std::string com = "com { kp: 1 kd: 1 } ", turn = "orientation { kp: 1 kd: 1 } ",
                    foot = "foot { kp: 1 kd: 1 } ";
  EXPECT_EQ(field_of(""), "accepted");  // gains by rule
  EXPECT_EQ(field_of("base_velocity_cutoff: -1"), "base_velocity_cutoff");
  EXPECT_EQ(field_of(com + turn + foot), "accepted");
  EXPECT_EQ(field_of("com { kp: -1 kd: 1 }"), "com.kp");
  EXPECT_EQ(field_of("com { kp: 1 }"), "com.kd");
  EXPECT_EQ(field_of("com { kp: 1 kd: nan }"), "com.kd");
  EXPECT_EQ(field_of(com + "orientation { kp: 1 kd: 0 }"), "orientation.kd");
  EXPECT_EQ(field_of(com + turn + foot + "posture { kp: 1 }"), "posture.kd");
}

}  // namespace
}  // namespace poise
