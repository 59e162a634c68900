// The tick path's functions must not touch the heap: malloc itself is counted.
#include <gtest/gtest.h>

#include "tests/allocation_counter.h"
#include "tests/robot/robot_test_support.h"
#include "tests/test_seed.h"

namespace poise::robot {
namespace {

TEST(Allocation, DynamicsAllocateNothing) {
  for (const TestRobot robot : {TestRobot::kDyros, TestRobot::kMantis}) {
    const RobotModel model = LoadTestRobot(robot);
    std::mt19937 random(TestSeed(1));
    const RobotState state = RandomState(model, &random);
    RobotData data(model);
    Eigen::VectorXd acceleration = Eigen::VectorXd::Ones(model.num_velocities());
    Eigen::VectorXd force(model.num_velocities());
    Matrix6X jacobian(6, model.num_velocities());
    const long before = allocations;
    ComputeKinematics(model, state, &data);
    ComputeFeet(model, &data);
    ComputeDynamics(model, state, &data);
    ComputePointJacobian(model, data, 1, Eigen::Vector3d::Ones(), jacobian);
    InverseDynamics(model, state, data, acceleration, force);
    EXPECT_EQ(allocations - before, 0);
  }
}

TEST(Allocation, TheCounterCounts) {
  const long before = allocations;
  const RobotData data(LoadTestRobot(TestRobot::kDyros));
  EXPECT_GT(allocations - before, 10);
}

}  // namespace
}  // namespace poise::robot
