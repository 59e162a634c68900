// Soles on ground and block, against statics and friction laws.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using Eigen::Vector3d;

double Weight(const Simulation& simulation) {
  return simulation.model().total_mass() * robot::kGravity;
}

// Force and moment about the world's origin of both feet on the robot.
robot::Vector6d Resultant(const SimulationTruth& truth) {
  robot::Vector6d sum = robot::Vector6d::Zero();
  for (size_t f = 0; f < 2; ++f) {
    const Eigen::Matrix3d r = truth.foot_pose[f].linear();
    const Vector3d force = r * truth.foot_wrench[f].head<3>();
    sum.head<3>() += force;
    sum.tail<3>() +=
        r * truth.foot_wrench[f].tail<3>() + truth.foot_pose[f].translation().cross(force);
  }
  return sum;
}

TEST(Standing, StartsOnTheGroundInBalance) {
  const EngineSimulation simulation(
      PaperRobot(),
      [] {
        SimConfig config = StandingConfig();
        config.mutable_start()->set_com_x(0.02);
        config.mutable_start()->set_com_y(-0.03);
        config.mutable_start()->set_com_height(0.70);
        config.mutable_start()->set_foot_spacing(0.25);
        return config;
      }(),
      kTick, 1);
  const SimulationTruth& truth = simulation.truth();
  EXPECT_LT((truth.com - Vector3d(0.02, -0.03, 0.70)).norm(), 1e-7);
  for (size_t f = 0; f < 2; ++f) {
    const Eigen::Isometry3d wanted(Eigen::Translation3d(0, f == 0 ? -0.125 : 0.125, 0));
    EXPECT_TRUE(truth.foot_pose[f].isApprox(wanted, 1e-7));
    EXPECT_EQ(truth.contact_points[f], 4);
  }
  // What the sensors report before the first step holds the robot at rest.
  const robot::Vector6d resultant = Resultant(truth);
  EXPECT_LT((resultant.head<3>() - Vector3d(0, 0, Weight(simulation))).norm(), 1e-8);
  EXPECT_LT((resultant.tail<3>() - truth.com.cross(Vector3d(0, 0, Weight(simulation)))).norm(),
            1e-8);
  EXPECT_GT(truth.foot_wrench[0][2], truth.foot_wrench[1][2]) << "the COM is nearer the right foot";
}

TEST(Standing, ContactForcesBalanceTheWeight) {
  for (const char* friction : {"", "joint_friction: false"}) {
    EngineSimulation simulation(PaperRobot(), StandingConfig(friction), kTick, 1);
    const PostureHolder holder(simulation);
    ASSERT_LT(holder.unbalanced().norm(), 1e-8);
    const Vector3d start = simulation.truth().com;
    for (int i = 0; i < 1000; ++i) {
      holder.Apply(&simulation);
      simulation.Advance();
      ASSERT_FALSE(simulation.fallen()) << simulation.end_reason();
      if (i == 0) {
        EXPECT_NEAR(Resultant(simulation.truth())[2], Weight(simulation), 0.01 * Weight(simulation))
            << "the first step must not be an impact";
      }
    }
    const SimulationTruth& truth = simulation.truth();
    const robot::Vector6d resultant = Resultant(truth);
    EXPECT_LT((resultant.head<3>() - Vector3d(0, 0, Weight(simulation))).norm(), 0.02);
    EXPECT_LT((resultant.tail<3>() - truth.com.cross(Vector3d(0, 0, Weight(simulation)))).norm(),
              0.02);
    EXPECT_LT((truth.com - start).norm(), 1e-4);
    EXPECT_EQ(truth.contact_points[0], 4);
    EXPECT_EQ(truth.contact_points[1], 4);
  }
}

// Each foot's wrench follows from the joint torques alone by statics of its own leg: torque = g -
// J_c^T F on the joints.
TEST(Standing, FootWrenchesAgreeWithTheJointTorques) {
  EngineSimulation simulation(PaperRobot(), StandingConfig("joint_friction: false"), kTick, 1);
  const PostureHolder holder(simulation);
  for (int i = 0; i < 1500; ++i) {
    holder.Apply(&simulation);
    simulation.Advance();
  }
  const SimulationTruth& truth = simulation.truth();
  const robot::RobotModel& model = simulation.model();
  robot::RobotData data(model);
  robot::ComputeKinematics(model, truth.state, &data);
  robot::ComputeFeet(model, &data);
  robot::ComputeDynamics(model, truth.state, &data);
  Eigen::VectorXd expected = data.gravity;
  for (size_t f = 0; f < 2; ++f) {
    robot::Vector6d wrench;
    wrench << data.foot_pose[f].linear() * truth.foot_wrench[f].head<3>(),
        data.foot_pose[f].linear() * truth.foot_wrench[f].tail<3>();
    expected -= data.foot_jacobian[f].transpose() * wrench;
  }
  EXPECT_LT((expected.tail(12) - truth.motor_torque).lpNorm<Eigen::Infinity>(), 0.01);
}

TEST(Standing, JointFrictionAloneHoldsThePosture) {
  const robot::RobotModel model = EditedRobot([](Robot* description) {
    for (auto& motor : *description->mutable_motor()) {
      motor.set_coulomb_friction(100);
      motor.clear_static_friction();
      motor.set_viscous_friction(0.5);
    }
  });
  EngineSimulation simulation(model, StandingConfig("friction_stiffness: 1e6"), kTick, 1);
  for (int i = 0; i < 2000; ++i) simulation.Advance();
  const Eigen::VectorXd settled = simulation.truth().state.joint_position;
  const double height = simulation.truth().com.z();
  for (int i = 0; i < 5000; ++i) simulation.Advance();
  // Within the soles' slip over 10 s (ODE's ground yields 1e-7 m/s per N sideways).
  EXPECT_LT((simulation.truth().state.joint_position - settled).norm(), 1e-7);
  EXPECT_NEAR(simulation.truth().com.z(), height, 1e-9);
}

TEST(Standing, OneFootCarriesAllWhenTheOtherIsUp) {
  SimConfig config = StandingConfig();
  config.mutable_start()->set_left_foot_height(0.1);
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  EXPECT_NEAR(simulation.truth().com.y(), simulation.truth().foot_pose[0].translation().y(), 1e-9);
  EXPECT_NEAR(simulation.truth().foot_wrench[0][2], Weight(simulation), 1e-8);
  for (int i = 0; i < 500; ++i) simulation.Advance();
  EXPECT_NEAR(simulation.truth().foot_wrench[0][2], Weight(simulation), 0.01);
  EXPECT_TRUE(simulation.truth().foot_wrench[1].isZero(0));
  EXPECT_EQ(simulation.truth().contact_points[1], 0);
  EXPECT_NEAR(simulation.truth().foot_pose[1].translation().z(), 0.1, 1e-4);
}

// A rigid robot on a soft block under both feet sinks by m g / (2 k), as two springs of stiffness
// k.
TEST(Block, SinksAsTheSpringsItIsMadeOf) {
  for (const double stiffness : {18000.0, 40000.0}) {
    for (const double step : {0.002, 0.001}) {
      SimConfig config = StandingConfig();
      config.set_step(step);
      SoftBlock* block = config.mutable_block();
      block->set_length(1);
      block->set_width(1);
      block->set_height(0.09);
      block->set_stiffness(stiffness);
      block->set_start(1e-6);
      EngineSimulation simulation(RigidRobot(), config, kTick, 1);
      robot::RobotState state = simulation.truth().state;
      state.base_position.z() += 0.09;
      simulation.SetState(state);
      for (int i = 0; i < 3000; ++i) simulation.Advance();
      const double sink = Weight(simulation) / (2 * stiffness);
      EXPECT_NEAR(simulation.truth().foot_pose[0].translation().z(), 0.09 - sink, 2e-5);
      EXPECT_NEAR(simulation.truth().foot_wrench[0][2] + simulation.truth().foot_wrench[1][2],
                  Weight(simulation), 0.01);
    }
  }
}

// What is too soft for the robot is pressed down to the ground, which carries what the springs do
// not.
TEST(Block, LiesOnTheGround) {
  SimConfig config = StandingConfig();
  SoftBlock* block = config.mutable_block();
  block->set_length(1);
  block->set_width(1);
  block->set_height(0.03);
  block->set_stiffness(2000);
  block->set_damping(200);
  block->set_start(1e-6);
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  robot::RobotState state = simulation.truth().state;
  state.base_position.z() += 0.03;
  simulation.SetState(state);
  ASSERT_GT(Weight(simulation) / (2 * 2000), 0.06);  // m, that the springs alone would sink
  for (int i = 0; i < 3000; ++i) simulation.Advance();
  EXPECT_NEAR(simulation.truth().foot_pose[0].translation().z(), 0, 1e-4);
  EXPECT_NEAR(simulation.truth().foot_wrench[0][2] + simulation.truth().foot_wrench[1][2],
              Weight(simulation), 0.01);
  // Four corners in the block and on the ground.
  EXPECT_EQ(simulation.truth().contact_points[0], 8);
}

// Dropped onto the block it swings at sqrt(k / m) and the logarithmic decrement of its damper.
TEST(Block, SwingsAsSpringAndDamper) {
  SimConfig config = StandingConfig();
  config.set_step(1e-4);
  SoftBlock* block = config.mutable_block();
  block->set_length(1);
  block->set_width(1);
  block->set_height(0.09);
  block->set_stiffness(20000);
  block->set_damping(60);
  block->set_start(1e-6);
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  robot::RobotState state = simulation.truth().state;
  state.base_position.z() += 0.09;
  simulation.SetState(state);
  const double k = 40000, d = 120, m = simulation.model().total_mass();
  const double omega = std::sqrt(k / m - d * d / (4 * m * m));
  const double rest = 0.09 - Weight(simulation) / k;
  // Half a period after the release from 0.09 m with no speed.
  const double half = std::numbers::pi / omega;
  while (simulation.time() < half) simulation.Step();
  const double expected = rest - (0.09 - rest) * std::exp(-d / (2 * m) * half);
  EXPECT_NEAR(simulation.truth().foot_pose[0].translation().z(), expected, 0.01 * (0.09 - rest));
}

TEST(Block, TheHigherSurfaceWins) {
  SimConfig config = StandingConfig();
  SoftBlock* block = config.mutable_block();
  block->set_y(0.105);
  block->set_width(0.2);
  block->set_height(0.004);  // under the left foot only
  block->set_stiffness(40000);
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  robot::RobotState state = simulation.truth().state;
  state.base_position.z() += 0.001;
  simulation.SetState(state);
  simulation.Step();
  // Every corner of the left foot is 3 mm deep in the block and off the ground, as the right ones.
  EXPECT_NEAR(simulation.truth().foot_wrench[1][2], 0.003 * 40000, 0.5 * 0.003 * 40000);
  EXPECT_EQ(simulation.truth().contact_points[1], 4);
  EXPECT_EQ(simulation.truth().contact_points[0], 0);
}

// A lift: at its greatest speed it accelerates nothing, so its spring carries the weight alone. A
// surface taken to stand still would brake with its damper, here by 94 mm/s · 4000 N·s/m a sole.
TEST(Block, ThatRisesCarriesTheRobotAtItsOwnSpeed) {
  SimConfig config = StandingConfig();
  SoftBlock* block = config.mutable_block();
  block->set_width(1);
  block->set_length(1);
  block->set_height(0.2);
  block->set_rise(4);
  block->set_stiffness(40000);
  block->set_damping(4000);
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  while (simulation.time() < 2) simulation.Step();
  const double depth = Weight(simulation) / (2 * 40000);
  for (const auto& sole : simulation.truth().foot_pose) {
    EXPECT_NEAR(0.1 - sole.translation().z(), depth, 0.05 * depth);
  }
  EXPECT_NEAR(simulation.truth().com_velocity.z(), 1.875 * 0.2 / 4, 0.002);
}

struct PushCase {
  const char* direction;
  int axis;
};

class GroundFriction : public ::testing::TestWithParam<PushCase> {};

TEST_P(GroundFriction, SticksBelowAndSlidesAbove) {
  constexpr double kMu = 0.1;  // low, so that the robot slides before it tips
  for (const double share : {0.95, 1.2}) {
    SimConfig config = StandingConfig();
    config.mutable_ground()->set_friction(kMu);
    EngineSimulation probe(RigidRobot(), config, kTick, 1);
    const double limit = kMu * Weight(probe);
    const Vector3d com_in_base = probe.truth().com - probe.truth().state.base_position;
    Push* push = config.add_push();
    push->set_start(0.2);
    push->set_duration(1);
    push->set_peak(share * limit);
    push->set_profile(Push::RECTANGLE);
    push->mutable_point()->set_x(com_in_base.x());
    push->mutable_point()->set_z(com_in_base.z());
    (GetParam().axis == 0 ? push->set_direction_x(1) : push->set_direction_y(1));
    EngineSimulation simulation(RigidRobot(), config, kTick, 1);
    while (simulation.time() < 0.2) simulation.Step();
    const Vector3d start = simulation.truth().com;
    while (simulation.time() < 0.6) simulation.Step();
    const double moved = (simulation.truth().com - start)[GetParam().axis];
    const double speed = simulation.truth().com_velocity[GetParam().axis];
    if (share < 1) {
      EXPECT_LT(std::abs(moved), 1e-4);
      EXPECT_LT(std::abs(speed), 1e-4);
    } else {
      const double acceleration = (share - 1) * limit / simulation.model().total_mass();
      EXPECT_NEAR(speed, acceleration * 0.4, 0.02 * acceleration * 0.4);
    }
    const robot::Vector6d resultant = Resultant(simulation.truth());
    EXPECT_NEAR(-resultant[GetParam().axis], std::min(share, 1.0) * limit, 0.01 * limit);
  }
}

INSTANTIATE_TEST_SUITE_P(Directions, GroundFriction,
                         ::testing::Values(PushCase{"x", 0}, PushCase{"y", 1}),
                         [](const auto& info) { return std::string(info.param.direction); });

}  // namespace
}  // namespace poise
