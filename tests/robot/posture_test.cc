#include "components/robot/posture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "components/framework/configuration/configuration.h"
#include "tests/robot/robot_test_support.h"

namespace poise::robot {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// Soles flat, `width` apart, the right one `stagger` ahead.
PostureGoal Standing(const RobotModel& model, double width, double stagger, double height) {
  PostureGoal goal;
  for (const Foot f : kFeet) {
    const double side = Side(f);
    goal.foot[f] = Eigen::Isometry3d::Identity();
    goal.foot[f].translation() = Vector3d(-side * stagger / 2, side * width / 2, 0);
  }
  goal.com_height = height;
  goal.nominal = VectorXd::Zero(model.num_joints());
  return goal;
}

void ExpectReached(const RobotModel& model, const PostureGoal& goal, const RobotState& state) {
  const RobotData data = Evaluate(model, state);
  for (size_t f = 0; f < 2; ++f) {
    EXPECT_LT((data.foot_pose[f].matrix() - goal.foot[f].matrix()).norm(), 1e-8);
  }
  EXPECT_LT((data.com.head<2>() - goal.com_xy).norm(), 1e-8);
  EXPECT_NEAR(data.com.z(), goal.com_height, 1e-8);
  const size_t body = static_cast<size_t>(model.body_task_body());
  EXPECT_LT((data.body_rotation[body] - Eigen::Matrix3d::Identity()).norm(), 1e-8);
  for (int j = 0; j < model.num_joints(); ++j) {
    const Joint& joint = model.joints()[static_cast<size_t>(j)];
    EXPECT_GE(state.joint_position[j], joint.lower) << joint.name;
    EXPECT_LE(state.joint_position[j], joint.upper) << joint.name;
  }
}

TEST(Posture, DyrosStandsAndShifts) {
  const RobotModel model = LoadTestRobot(TestRobot::kDyros);
  for (const double height : {0.76, 0.72, 0.65}) {
    for (const double y : {-0.1, 0.0, 0.08}) {
      PostureGoal goal = Standing(model, 0.21, 0, height);
      goal.com_xy = {0.02, y};
      ExpectReached(model, goal, SolvePosture(model, goal));
    }
  }
}

TEST(Posture, SoleAtDifferentHeightsAndTilts) {
  const RobotModel model = LoadTestRobot(TestRobot::kDyros);
  PostureGoal goal = Standing(model, 0.24, 0.1, 0.72);
  goal.foot[Foot::kLeft].translation().z() = 0.09;
  goal.foot[Foot::kLeft].linear() =
      (Eigen::AngleAxisd(0.1, Vector3d::UnitX()) * Eigen::AngleAxisd(-0.15, Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.2, Vector3d::UnitZ()))
          .toRotationMatrix();
  goal.com_xy = {0.0, -0.08};
  ExpectReached(model, goal, SolvePosture(model, goal));
}

TEST(Posture, SymmetricGoalGivesSymmetricLegs) {
  const RobotModel model = LoadTestRobot(TestRobot::kDyros);
  const RobotState state = SolvePosture(model, Standing(model, 0.21, 0, 0.75));
  for (const char* name : {"hip_pitch", "knee_pitch", "ankle_pitch"}) {
    EXPECT_NEAR(state.joint_position[model.FindJoint(std::string("right_") + name)],
                state.joint_position[model.FindJoint(std::string("left_") + name)], 1e-7);
  }
  // Upright body on flat soles: the pitch angles of a leg cancel.
  EXPECT_NEAR(state.joint_position[model.FindJoint("right_hip_pitch")] +
                  state.joint_position[model.FindJoint("right_knee_pitch")] +
                  state.joint_position[model.FindJoint("right_ankle_pitch")],
              0, 1e-7);
}

TEST(Posture, FreeJointsStayNearNominal) {
  const RobotModel model = LoadTestRobot(TestRobot::kMantis);
  PostureGoal goal = Standing(model, 0.2, 0.03, 0.66);
  goal.nominal[model.FindJoint("left_elbow")] = -0.8;
  goal.nominal[model.FindJoint("right_elbow")] = -0.8;
  goal.nominal[model.FindJoint("left_knee")] = 0.6;
  goal.nominal[model.FindJoint("right_knee")] = 0.6;
  const RobotState state = SolvePosture(model, goal);
  ExpectReached(model, goal, state);
  // Nearest to nominal: no motion that keeps the goal brings the joints nearer.
  const RobotData data = Evaluate(model, state);
  const int n = model.num_velocities();
  Matrix6X body(6, n);
  ComputePointJacobian(model, data, model.body_task_body(), Vector3d::Zero(), body);
  Eigen::MatrixXd goal_jacobian(18, n);
  goal_jacobian << data.foot_jacobian[0], data.foot_jacobian[1], body.bottomRows<3>(),
      data.com_jacobian;
  VectorXd towards = VectorXd::Zero(n);
  towards.tail(model.num_joints()) = goal.nominal - state.joint_position;
  const VectorXd explained = goal_jacobian.transpose().colPivHouseholderQr().solve(towards);
  EXPECT_LT((goal_jacobian.transpose() * explained - towards).norm(), 1e-6);
  EXPECT_GT(towards.norm(), 1e-2);
}

std::string Refusal(const RobotModel& model, const PostureGoal& goal) {
  try {
    SolvePosture(model, goal);
  } catch (const RobotError& error) {
    return error.what();
  }
  return "reached";
}

TEST(Posture, SaysWhatCannotBeReached) {
  const RobotModel model = LoadTestRobot(TestRobot::kDyros);
  using testing::HasSubstr;
  EXPECT_THAT(Refusal(model, Standing(model, 0.21, 0, 1.5)),
              testing::AllOf(HasSubstr("posture cannot be reached"), HasSubstr("misses by"),
                             HasSubstr(" m")));
  EXPECT_THAT(Refusal(model, Standing(model, 2.0, 0, 0.7)), HasSubstr("misses by"));
  PostureGoal tilted = Standing(model, 0.21, 0, 0.75);
  tilted.foot[Foot::kRight].linear() = Eigen::AngleAxisd(1.2, Vector3d::UnitX()).toRotationMatrix();
  EXPECT_THAT(Refusal(model, tilted), HasSubstr("joints at their limits"));
}

TEST(Posture, RefusesGoalsThatAreNone) {
  const RobotModel model = LoadTestRobot(TestRobot::kDyros);
  PostureGoal goal = Standing(model, 0.21, 0, 0.75);
  goal.nominal.resize(3);
  EXPECT_THAT(Refusal(model, goal), testing::HasSubstr("nominal has 3 joints, the robot 12"));
  goal = Standing(model, 0.21, 0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(Refusal(model, goal), testing::HasSubstr("not finite"));
}

TEST(StandingHeight, IsTheStancesOwnOrWhatItsJointsGive) {
  Robot description;
  ReadTextProto(RobotPath(TestRobot::kDyros), &description);
  const std::string urdf = ReadWhole(UrdfPath(TestRobot::kDyros));
  EXPECT_EQ(StandingHeight(MakeRobot(description, urdf)), 0.75);
  description.mutable_stance()->clear_com_height();
  const RobotModel model = MakeRobot(description, urdf);
  // Both legs bent by 0.3, 0.6, 0.3 rad: thigh and shank of 0.36 m each lower the hips by this
  // much.
  const double lowered = 0.72 * (1 - std::cos(0.3));
  description.mutable_stance()->clear_joint();
  const double straight = StandingHeight(MakeRobot(description, urdf));
  const double share = model.bodies()[0].mass / model.total_mass();
  const double bent = StandingHeight(model);
  EXPECT_LT(bent, straight - share * lowered) << "the body and parts of the legs are lower";
  EXPECT_GT(bent, straight - lowered);
}

}  // namespace
}  // namespace poise::robot
