// Falls, breakdowns, hostile commands, determinism, allocation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>

#include "sim/sensors.h"
#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace {
size_t allocations = 0;
}  // namespace

[[gnu::noinline]] void* operator new(size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept { std::free(memory); }

namespace poise {
namespace {

using ::testing::Test;

bool Finite(const SimulationTruth& truth) {
  return truth.com.allFinite() && truth.com_velocity.allFinite() &&
         truth.state.base_position.allFinite() && truth.state.joint_position.allFinite() &&
         truth.state.joint_velocity.allFinite() && truth.foot_wrench[0].allFinite() &&
         truth.foot_wrench[1].allFinite() && truth.imu_specific_force.allFinite() &&
         truth.friction_torque.allFinite() && truth.motor_torque.allFinite();
}

TEST(Fall, ALimpRobotFalls) {
  EngineSimulation simulation(PaperRobot(), StandingConfig(), kTick, 1);
  double fell_at = 0;
  for (int i = 0; i < 2000 && !simulation.fallen(); ++i) {
    simulation.Advance();
    fell_at = simulation.time();
  }
  ASSERT_TRUE(simulation.fallen());
  EXPECT_FALSE(simulation.broken());
  EXPECT_GT(fell_at, 0.1) << "a fall takes time";
  EXPECT_LT(fell_at, 2.0);
  const std::string reason(simulation.end_reason());
  EXPECT_EQ(reason.rfind("the robot fell at ", 0), 0u) << reason;
  // Flailing goes on without harm, and the reason stays.
  for (int i = 0; i < 1000; ++i) simulation.Advance();
  EXPECT_TRUE(Finite(simulation.truth()));
  EXPECT_EQ(simulation.end_reason(), reason);
}

TEST(Fall, GroundThatGivesWayIsNoFall) {
  // Blocks of 1 kN/m under each sole: the robot goes down with them by more than 0.3 of its height.
  SimConfig config = StandingConfig(
      "block_field { start: -2 rows: 10 height: 0 tilt: 0 stagger: 0 least_stiffness: 1000 "
      "most_stiffness: 1000 }");
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  const double height = simulation.truth().com.z();
  double lowest = height;
  for (int i = 0; i < 300 && !simulation.fallen(); ++i) {
    simulation.Advance();
    lowest = std::min(lowest, simulation.truth().com.z());
  }
  EXPECT_FALSE(simulation.fallen()) << simulation.end_reason();
  EXPECT_LT(lowest, 0.65 * height);
}

TEST(Fall, TiltIsNamed) {
  SimConfig config =
      StandingConfig("push { start: 0 duration: 0.1 peak: 3000 direction_x: 1 point { z: 0.2 } }");
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  for (int i = 0; i < 1000 && !simulation.fallen(); ++i) simulation.Advance();
  EXPECT_NE(simulation.end_reason().find("body tilt"), std::string_view::npos)
      << simulation.end_reason();
}

TEST(Hostile, CurrentsThatAreNotFiniteCountAsZero) {
  EngineSimulation a(PaperRobot(), StandingConfig(), kTick, 1),
      b(PaperRobot(), StandingConfig(), kTick, 1);
  std::vector<double> bad(12, 1.5), zeroed(12, 1.5);
  bad[2] = std::numeric_limits<double>::quiet_NaN();
  bad[5] = -std::numeric_limits<double>::infinity();
  zeroed[2] = zeroed[5] = 0;
  const std::vector<int8_t> enabled(12, 1);
  for (int i = 0; i < 50; ++i) {
    a.SetCurrents(bad, enabled);
    b.SetCurrents(zeroed, enabled);
    a.Advance();
    b.Advance();
  }
  EXPECT_EQ(a.truth().state.joint_position, b.truth().state.joint_position);
}

TEST(Hostile, TooFewCurrentsLeaveMotorsFree) {
  EngineSimulation simulation(PaperRobot(), StandingConfig(), kTick, 1);
  simulation.SetCurrents(std::vector<double>{1, 2}, std::vector<int8_t>{1, 1, 1});
  simulation.Step();
  EXPECT_EQ(simulation.truth().motor_current[1], 2);
  EXPECT_EQ(simulation.truth().motor_current[2], 0);
}

TEST(Hostile, ABreakdownOfTheEngineEndsTheRunAndNotTheProcess) {
  for (const double current : {1e305, 1e150, 1e30}) {
    EngineSimulation simulation(PaperRobot(), StandingConfig("torque_limits: false"), kTick, 1);
    std::vector<double> currents(12, current);
    currents[3] = -current;
    for (int i = 0; i < 200; ++i) {
      simulation.SetCurrents(currents, std::vector<int8_t>(12, 1));
      simulation.Advance();
      ASSERT_TRUE(Finite(simulation.truth()));
    }
    EXPECT_TRUE(simulation.broken() || simulation.fallen()) << current;
    EXPECT_FALSE(simulation.end_reason().empty());
    if (current > 1e300) {
      EXPECT_TRUE(simulation.broken());
    }
  }
}

TEST(Determinism, InstancesAndRepetitionsAgreeBitForBit) {
  SimConfig config = StandingConfig(
      "push { start: 0.1 duration: 0.1 peak: 150 direction_y: 1 } "
      "block { x: 0.1 y: 0.105 height: 0.003 irregularity: 0.002 }");
  const robot::RobotModel model = PaperRobot();
  EngineSimulation a(model, config, kTick, 9), b(model, config, kTick, 9);
  Sensors sensors_a(model, SimulatedNoise(model, config), 9),
      sensors_b(model, SimulatedNoise(model, config), 9);
  SensorReadings readings_a(12), readings_b(12);
  const PostureHolder holder(a);
  std::vector<Eigen::VectorXd> history;
  for (int i = 0; i < 300; ++i) {
    for (Simulation* simulation : {&a, &b}) {
      holder.Apply(simulation);
      simulation->Advance();
    }
    sensors_a.Measure(a.truth(), &readings_a);
    sensors_b.Measure(b.truth(), &readings_b);
    ASSERT_EQ(a.truth().state.joint_position, b.truth().state.joint_position) << i;
    ASSERT_EQ(a.truth().foot_wrench[1], b.truth().foot_wrench[1]) << i;
    ASSERT_EQ(readings_a.position_counts, readings_b.position_counts) << i;
    ASSERT_EQ(readings_a.foot_wrench[0], readings_b.foot_wrench[0]) << i;
    history.push_back(a.truth().state.joint_velocity);
  }
  EngineSimulation again(model, config, kTick, 9);
  for (const Eigen::VectorXd& velocity : history) {
    holder.Apply(&again);
    again.Advance();
    ASSERT_EQ(again.truth().state.joint_velocity, velocity);
  }
}

TEST(Determinism, AnotherSeedAnotherBlock) {
  SimConfig config = StandingConfig("block { y: 0.105 height: 0.003 irregularity: 0.002 }");
  EngineSimulation a(RigidRobot(), config, kTick, 1), b(RigidRobot(), config, kTick, 2);
  for (int i = 0; i < 50; ++i) {
    a.Advance();
    b.Advance();
  }
  EXPECT_NE(a.truth().foot_wrench[1], b.truth().foot_wrench[1]);
}

// operator new only: an engine may allocate with malloc inside its step.
TEST(TickPath, OurCodeDoesNotAllocate) {
  SimConfig config = StandingConfig("push { start: 0.02 duration: 0.1 peak: 50 direction_y: 1 }");
  const robot::RobotModel model = PaperRobot();
  EngineSimulation simulation(model, config, kTick, 1);
  Sensors sensors(model, SimulatedNoise(model, config), 1);
  SensorReadings readings(model.num_joints());
  const std::vector<double> current(12, 0.5);
  const std::vector<int8_t> enabled(12, 1);
  const size_t before = allocations;
  for (int i = 0; i < 500; ++i) {
    simulation.SetCurrents(current, enabled);
    simulation.Advance();
    sensors.Measure(simulation.truth(), &readings);
  }
  EXPECT_TRUE(simulation.fallen()) << "the fall's message is part of the path";
  EXPECT_EQ(allocations, before);
}

}  // namespace
}  // namespace poise
