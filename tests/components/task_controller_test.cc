// The task controller with a faked estimator, against the equations of motion solved directly.
#include "components/task_controller/task_controller.h"

#include <gtest/gtest.h>

#include <limits>

#include "components/messages/conversions.h"
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

// The motion that the torque gives, solved from the equations of motion, is the motion that was
// asked for: k_p e + k_d ė of the COM, of the body and of the free foot, references held from the
// first tick.
TEST_P(TaskControllerCase, TheTorqueGivesTheDesiredAccelerations) {
  const auto body = static_cast<size_t>(model_.body_task_body());
  double worst = 0;
  for (int trial = 0; trial < 100; ++trial) {
    Harness<TaskController> harness(
        &context_,
        TaskConfig(std::string("phase { start: 0 support: ") + GetParam().support + " }"));
    const robot::RobotState first = Disturbed(standing_, 0.05, 0.3, &random_);
    robot_state_t message = StateMessage(model_, first);
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(0));
    const robot::RobotState now = Disturbed(first, 0.05, 0.5, &random_);
    message = StateMessage(model_, now);
    harness.Run(TickAt(1));
    const auto& out = harness.output<task_torque_t>();
    ASSERT_EQ(out.status, task_torque_t::STATUS_OK);
    for (size_t i = 0; i < 2; ++i) ASSERT_EQ(out.in_contact[i] != 0, GetParam().in_contact[i]);

    const Dynamics start(model_, first, GetParam().in_contact);
    const Dynamics dynamics(model_, now, GetParam().in_contact);
    Eigen::VectorXd acceleration, wrench;
    dynamics.Forward(ToEigen(out.torque), &acceleration, &wrench);
    const robot::RobotData& d = dynamics.data;

    const Eigen::Vector3d com = 225 * (start.data.com - d.com) - 10 * d.com_velocity;
    const Eigen::Vector3d com_got = d.com_jacobian * acceleration + d.com_bias_acceleration;
    const Eigen::Vector3d error =
        RotationVector(start.data.body_rotation[body] * d.body_rotation[body].transpose());
    const Eigen::Vector3d turn = 150 * error - 20 * d.body_angular_velocity[body];
    robot::Matrix6X jacobian = robot::Matrix6X::Zero(6, model_.num_velocities());
    robot::ComputePointJacobian(model_, d, static_cast<int>(body), Eigen::Vector3d::Zero(),
                                jacobian);
    const Eigen::Vector3d turn_got =
        jacobian.bottomRows<3>() * acceleration + d.body_angular_bias[body];
    worst = std::max({worst, (com - com_got).norm(), (turn - turn_got).norm()});
    EXPECT_LT((GetVector3(out.body_orientation_error) - error).norm(), 1e-12);
    EXPECT_LT((GetVector3(out.com_position) - d.com).norm(), 1e-12);
    EXPECT_LT((GetVector3(out.com_desired) - start.data.com).norm(), 1e-12);
    for (size_t i = 0; i < 2; ++i) {
      if (GetParam().in_contact[i]) continue;
      const Eigen::Isometry3d &from = d.foot_pose[i], &to = start.data.foot_pose[i];
      Eigen::VectorXd wanted(6);
      wanted << 100 * (to.translation() - from.translation()),
          100 * RotationVector(to.linear() * from.linear().transpose());
      wanted -= 15 * d.foot_velocity[i];
      const Eigen::VectorXd got = d.foot_jacobian[i] * acceleration + d.foot_bias_acceleration[i];
      worst = std::max(worst, (wanted - got).norm());
      EXPECT_LT((GetPose(out.foot_desired[i]).matrix() - to.matrix()).norm(), 1e-12);
    }
  }
  EXPECT_LT(worst, 1e-8);  // m/s², rad/s²
  RecordProperty("worst_residual", testing::PrintToString(worst));
}

TEST_P(TaskControllerCase, GravityCompensationHoldsTheRobotStill) {
  Harness<TaskController> harness(&context_,
                                  TaskConfig(std::string("phase { start: 0 gravity_compensation: "
                                                         "true support: ") +
                                             GetParam().support + " }"));
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
    // No task: desired is actual.
    EXPECT_LT((GetVector3(out.com_desired) - dynamics.data.com).norm(), 1e-12);
  }
}

TEST_P(TaskControllerCase, KeepsTheLastTorqueWhenTheStateIsUnusable) {
  Harness<TaskController> harness(
      &context_, TaskConfig(std::string("phase { start: 0 support: ") + GetParam().support + " }"));
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
  harness.Run(TickAt(2));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK);
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
  Harness<TaskController> harness(&context, TaskConfig("phase { start: 0 }"));
  robot_state_t message = StateMessage(model, StandingState(model));
  harness.Bind("robot_state", &message);
  harness.Run(TickAt(0));
  const std::vector<double> good = harness.output<task_torque_t>().torque;
  message = StateMessage(model, robot::RobotState(model.num_joints()));
  harness.Run(TickAt(1));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_SINGULAR);
  EXPECT_EQ(harness.output<task_torque_t>().torque, good);
}

TEST(TaskController, ARobotWithFreeJointsNeedsPostureGains) {
  ControlContext context(TestRobot::kMantis);
  try {
    Harness<TaskController> harness(
        &context, "com { kp: 1 kd: 1 } orientation { kp: 1 kd: 1 } phase { start: 0 }");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), "posture");
  }
}

// The joints that the tasks leave free return to their posture instead of falling.
TEST(TaskController, FreeJointsAreHeld) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kMantis);
  ControlContext context(TestRobot::kMantis);
  Harness<TaskController> harness(&context, TaskConfig("phase { start: 0 }"));
  const robot::RobotState standing = StandingState(model);
  const robot_state_t message = StateMessage(model, standing);
  harness.Bind("robot_state", &message);
  harness.Run(TickAt(0));
  const Dynamics dynamics(model, standing, {true, true});
  Eigen::VectorXd acceleration, wrench;
  dynamics.Forward(ToEigen(harness.output<task_torque_t>().torque), &acceleration, &wrench);
  EXPECT_LT(acceleration.norm(), 1e-7);
}

// A quaternion off by less than the message's tolerance gives the torque of its direction; one
// beyond is refused.
TEST(TaskController, NormalisesTheOrientationItAccepts) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<TaskController> harness(&context, TaskConfig("phase { start: 0 }"));
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

TEST(TaskController, ReportsAWaitingUnloading) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<TaskController> harness(
      &context,
      TaskConfig("phase { start: 0 transition { kind: UNLOAD foot: LEFT_FOOT duration: 0.01 } } "
                 "phase { start: 0.1 support: RIGHT }"));
  robot::RobotState state = StandingState(model);  // COM between the feet
  robot_state_t message = StateMessage(model, state);
  harness.Bind("robot_state", &message);
  for (int tick = 0; tick < 100; ++tick) {
    harness.Run(TickAt(tick));
    const auto& out = harness.output<task_torque_t>();
    ASSERT_EQ(out.status, task_torque_t::STATUS_WAITING);
    ASSERT_EQ(out.phase, 0);
    ASSERT_EQ(out.transition, task_torque_t::TRANSITION_NONE);
    ASSERT_EQ(out.in_contact[1], 1);
  }
  // The whole robot leant about the soles' middle until the COM is over the right foot.
  state.base_position.y() -= 0.1;
  message = StateMessage(model, state);
  // Soles moved with it: still between the feet.
  harness.Run(TickAt(100));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_WAITING);
  const Eigen::Quaterniond lean(Eigen::AngleAxisd(0.12, Eigen::Vector3d::UnitX()));
  state.base_position = lean * state.base_position;
  state.base_orientation = lean * state.base_orientation;
  message = StateMessage(model, state);
  const robot::RobotData data = robot::Evaluate(model, state);
  // Inside the sole (75 mm) is not enough: 25 mm less are its reduced rectangle.
  ASSERT_LT(std::abs(data.com.y() - data.foot_pose[0].translation().y()), 0.05);
  // On its way out: the point where it can be brought to rest lies 80 mm further.
  robot::RobotState moving = state;
  moving.base_linear_velocity.y() = 0.3;
  message = StateMessage(model, moving);
  harness.Run(TickAt(101));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_WAITING);
  message = StateMessage(model, state);
  harness.Run(TickAt(102));
  EXPECT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK);
  EXPECT_EQ(harness.output<task_torque_t>().transition, task_torque_t::TRANSITION_UNLOADING);
  EXPECT_EQ(harness.output<task_torque_t>().transition_foot, 1);
}

// A robot on its right foot whose left one, lowered at 0.1 s, is to carry from 0.4 s on.
class TouchDown : public testing::Test {
 protected:
  explicit TouchDown(const std::string& contact = "")
      : harness_(&context_,
                 TaskConfig(contact +
                            "phase { start: 0 support: RIGHT } "
                            "phase { start: 0.1 support: RIGHT foot { foot: LEFT_FOOT z: -0.02 "
                            "duration: 0.1 } } "
                            "phase { start: 0.4 transition { kind: LOAD foot: LEFT_FOOT duration: "
                            "0.1 } }")) {
    message_ = StateMessage(robot::LoadTestRobot(TestRobot::kDyros),
                            StandingState(robot::LoadTestRobot(TestRobot::kDyros)));
    message_.foot_wrench[0].force[2] = -500;
    harness_.Bind("robot_state", &message_);
  }
  /// `load` on the left sole, N, until `time`, s.
  const task_torque_t& Run(double time, double load) {
    message_.foot_wrench[1].force[2] = -load;
    while (TickAt(tick_).time < time - 1e-9) harness_.Run(TickAt(tick_++));
    return harness_.output<task_torque_t>();
  }

  ControlContext context_{TestRobot::kDyros};
  Harness<TaskController> harness_;
  robot_state_t message_;
  int64_t tick_ = 0;
};

TEST_F(TouchDown, InTimeDoesNotShiftTheSchedule) {
  EXPECT_EQ(Run(0.07, 0).foot_state[1], task_torque_t::FOOT_SWING);
  EXPECT_EQ(Run(0.4, 12).foot_state[1], task_torque_t::FOOT_TOUCHING);
  EXPECT_EQ(harness_.output<task_torque_t>().in_contact[1], 0);
  const task_torque_t& out = Run(0.402, 12);
  EXPECT_EQ(out.status, task_torque_t::STATUS_OK);
  EXPECT_EQ(out.phase, 2);
  EXPECT_EQ(out.in_contact[1], 1);
  EXPECT_EQ(out.foot_state[1], task_torque_t::FOOT_SUPPORT);
  EXPECT_EQ(out.transition, task_torque_t::TRANSITION_LOADING);
  EXPECT_NEAR(out.transition_progress, 0, 1e-8);
}

TEST_F(TouchDown, LateHoldsTheScheduleUntilTheLoadHasLasted) {
  EXPECT_EQ(Run(0.2, 0).foot_state[1], task_torque_t::FOOT_SWING);
  EXPECT_EQ(Run(0.21, 0).foot_state[1], task_torque_t::FOOT_SEARCHING);
  EXPECT_EQ(Run(0.4, 0).status, task_torque_t::STATUS_OK);
  const task_torque_t& out = Run(0.5, 0);
  EXPECT_EQ(out.status, task_torque_t::STATUS_WAITING);
  EXPECT_EQ(out.waiting_for, task_torque_t::WAITING_CONTACT);
  EXPECT_EQ(out.phase, 1);
  EXPECT_LT(out.foot_desired[1].position[2], out.foot_pose[1].position[2] - 0.02);
  // 0.02 s of load, then 0.3 s in which it settles.
  EXPECT_EQ(Run(0.52, 12).foot_state[1], task_torque_t::FOOT_SEARCHING);
  EXPECT_EQ(Run(0.522, 12).foot_state[1], task_torque_t::FOOT_TOUCHING);
  EXPECT_EQ(Run(0.82, 12).waiting_for, task_torque_t::WAITING_CONTACT);
  EXPECT_EQ(Run(0.824, 12).phase, 2);
  EXPECT_EQ(out.status, task_torque_t::STATUS_OK);
  EXPECT_EQ(out.waiting_for, task_torque_t::WAITING_NONE);
}

// This foot does not move: its reference gives up at twice the depth.
TEST_F(TouchDown, WithoutASurfaceItEndsInSingleSupport) {
  const task_torque_t& out = Run(8, 0);
  EXPECT_EQ(out.status, task_torque_t::STATUS_WAITING);
  EXPECT_EQ(out.waiting_for, task_torque_t::WAITING_NO_SURFACE);
  EXPECT_EQ(out.foot_state[1], task_torque_t::FOOT_RETRACTED);
  EXPECT_EQ(out.phase, 1);
  EXPECT_NEAR(out.foot_desired[1].position[2], -0.02 - 0.12 + 0.05, 1e-3);
  EXPECT_EQ(Run(9, 100).phase, 1);  // for good
}

TEST_F(TouchDown, ALoadThatIsNoNumberIsAnInvalidState) {
  Run(0.1, 0);
  EXPECT_EQ(Run(0.11, std::numeric_limits<double>::quiet_NaN()).status,
            task_torque_t::STATUS_INVALID_STATE);
  EXPECT_EQ(Run(0.12, 0).status, task_torque_t::STATUS_OK);
}

class UnconfirmedTouchDown : public TouchDown {
 protected:
  UnconfirmedTouchDown() : TouchDown("contact { required: false } ") {}
};

TEST_F(UnconfirmedTouchDown, FollowsTheScheduleAlone) {
  EXPECT_EQ(Run(0.4, 0).foot_state[1], task_torque_t::FOOT_SWING);
  EXPECT_EQ(Run(0.402, 0).phase, 2);
}

}  // namespace
}  // namespace poise
