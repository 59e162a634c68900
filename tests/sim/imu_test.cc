// The true motion that the IMU measures, on the simulated robot.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using Eigen::Vector3d;

TEST(Imu, ReadsGravityUpwardAtRest) {
  EngineSimulation simulation(RigidRobot(), StandingConfig(), kTick, 1);
  EXPECT_LT((simulation.truth().imu_specific_force - Vector3d(0, 0, robot::kGravity)).norm(), 1e-12)
      << "before the first step";
  for (int i = 0; i < 250; ++i) simulation.Advance();
  EXPECT_LT((simulation.truth().imu_specific_force - Vector3d(0, 0, robot::kGravity)).norm(), 1e-4);
  EXPECT_LT(simulation.truth().imu_angular_velocity.norm(), 1e-6);
}

TEST(Imu, ReadsNothingInFreeFall) {
  EngineSimulation simulation(PaperRobot(), BareConfig(), kTick, 1);
  robot::RobotState state = simulation.truth().state;
  state.base_position.z() += 5;
  simulation.SetState(state);
  for (int i = 0; i < 100; ++i) simulation.Advance();
  EXPECT_LT(simulation.truth().imu_specific_force.norm(), 1e-8);
}

// The robot drops onto its soles. All that the accelerometer has told, less gravity, is the
// velocity that its place has gained, whichever step of the engine an impact falls into.
TEST(Imu, LosesNoImpact) {
  const robot::RobotModel model = PaperRobot();
  EngineSimulation simulation(model, BareConfig(), kTick, 1);
  robot::RobotState state = simulation.truth().state;
  state.base_position.z() += 0.02;
  simulation.SetState(state);
  const robot::ImuModel& imu = model.imu();
  ASSERT_EQ(imu.body, 0);
  Vector3d told = Vector3d::Zero();
  double hardest = 0;
  for (int i = 0; i < 100; ++i) {
    simulation.Advance();
    const SimulationTruth& truth = simulation.truth();
    const Vector3d acceleration =
        truth.imu_orientation * truth.imu_specific_force - Vector3d(0, 0, robot::kGravity);
    hardest = std::max(hardest, acceleration.norm());
    told += kTick * acceleration;
    const robot::RobotState& now = truth.state;
    const Vector3d gained =
        now.base_linear_velocity +
        now.base_angular_velocity.cross(now.base_orientation * imu.pose.translation());
    EXPECT_LT((told - gained).norm(), 1e-9) << i;
  }
  EXPECT_GT(hardest, 2 * robot::kGravity) << "nothing hit the ground";
}

// In flight with spin and moving joints, against second differences of where the IMU is.
TEST(Imu, FeelsTheAccelerationOfItsOwnPlace) {
  SimConfig config = BareConfig();
  config.set_step(1e-5);
  const robot::RobotModel model = EditedRobot([](Robot* description) {
    Pose* pose = description->mutable_imu()->mutable_pose();
    pose->set_x(0.3);
    pose->set_z(0.2);
    pose->set_roll(0.4);
    pose->set_yaw(-1.1);
  });
  // The period over which the IMU's acceleration is a mean is one step.
  EngineSimulation simulation(model, config, config.step(), 1);
  robot::RobotState state = simulation.truth().state;
  state.base_position.z() += 5;
  state.base_angular_velocity = Vector3d(1, -2, 3);
  for (int j = 0; j < 12; ++j) state.joint_velocity[j] = j % 2 == 0 ? 1.5 : -1;
  simulation.SetState(state);
  const robot::ImuModel& imu = model.imu();
  ASSERT_EQ(imu.body, 0);
  std::array<Vector3d, 3> place;
  for (Vector3d& p : place) {
    simulation.Step();
    const robot::RobotState& now = simulation.truth().state;
    p = now.base_position + now.base_orientation * imu.pose.translation();
  }
  const Vector3d acceleration =
      (place[2] - 2 * place[1] + place[0]) / (simulation.step() * simulation.step());
  const SimulationTruth& truth = simulation.truth();
  const Eigen::Matrix3d to_imu = (truth.state.base_orientation * imu.pose.linear()).transpose();
  const Vector3d expected = to_imu * (acceleration + Vector3d(0, 0, robot::kGravity));
  EXPECT_GT(expected.norm(), 1);
  EXPECT_LT((truth.imu_specific_force - expected).norm(), 1e-3 * expected.norm());
  EXPECT_LT((truth.imu_angular_velocity - to_imu * truth.state.base_angular_velocity).norm(),
            1e-12);
}

}  // namespace
}  // namespace poise
