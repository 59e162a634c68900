// The drive train's effects in the simulated robot: current loop, delay, encoders, and none at all.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

SimConfig With(const std::string& drive_train, const std::string& more = "") {
  return StandingConfig("drive_train { " + drive_train + " } " + more);
}

void Lift(Simulation* simulation) {
  robot::RobotState state = simulation->truth().state;
  state.base_position.z() += 5;
  simulation->SetState(state);
}

void SetCurrent(double amperes, Simulation* simulation) {
  const std::vector<double> current(12, amperes);
  const std::vector<int8_t> enabled(12, 1);
  simulation->SetCurrents(current, enabled);
}

// Mean over step n of c (1 - e^(-t / T)).
TEST(CurrentLoop, StepResponseIsExactWhateverTheStep) {
  const double lag = 0.8e-3, command = 4;
  for (const double h : {2e-3, 1e-3, 1e-4}) {
    SimConfig config = With("torque_lag: 0.0008");
    config.set_step(h);
    EngineSimulation simulation(PaperRobot(), config, kTick, 1);
    Lift(&simulation);
    SetCurrent(command, &simulation);
    for (int n = 0; n < 8; ++n) {
      simulation.Step();
      const double mean =
          command * (1 + lag / h * (std::exp(-(n + 1) * h / lag) - std::exp(-n * h / lag)));
      EXPECT_NEAR(simulation.truth().motor_current[3], mean, 1e-12);
      EXPECT_NEAR(simulation.truth().motor_torque[3], 5 * mean, 1e-12);
    }
  }
}

TEST(CurrentLoop, CommandsAreRoundedAndStillLimited) {
  EngineSimulation simulation(PaperRobot(), With("current_resolution: 0.4"), kTick, 1);
  const struct {
    double command, current;
  } cases[] = {{1.19, 1.2}, {1.01, 1.2}, {0.99, 0.8}, {-0.21, -0.4}, {0.19, 0}, {1000, 20}};
  for (const auto& c : cases) {
    SetCurrent(c.command, &simulation);
    simulation.Step();
    EXPECT_NEAR(simulation.truth().motor_current[0], c.current, 1e-12) << c.command;  // 100 N·m
  }
}

// The largest torque error of the robot's joints is half a step of the drive.
TEST(CurrentLoop, RoundingErrsByHalfAStepAtMost) {
  EngineSimulation simulation(PaperRobot(), With("current_resolution: 0.015"), kTick, 1);
  double worst = 0;
  for (int i = 0; i < 300; ++i) {
    const double command = -3 + 0.0213 * i;
    SetCurrent(command, &simulation);
    simulation.Step();
    worst = std::max(worst, std::abs(simulation.truth().motor_torque[0] - 5 * command));
  }
  EXPECT_LE(worst, 5 * 0.015 / 2 + 1e-12);
  EXPECT_GT(worst, 0.95 * 5 * 0.015 / 2);
}

TEST(SensorDelay, SensorsSeeThePast) {
  constexpr size_t kDelay = 3;  // steps: not whole ticks
  EngineSimulation simulation(
      PaperRobot(),
      With("sensor_delay: 0.003",
           "push { start: 0 duration: 0.05 peak: 100 direction_y: 1 profile: RECTANGLE }"),
      kTick, 1);
  std::vector<SimulationTruth> past = {simulation.truth()};
  EXPECT_EQ(simulation.measured().encoder_position, past[0].encoder_position);
  const PostureHolder holder(simulation);
  for (size_t i = 1; i < 40; ++i) {
    holder.Apply(&simulation);
    simulation.Step();
    past.push_back(simulation.truth());
    const SimulationTruth& then = past[i < kDelay ? 0 : i - kDelay];
    const SimulationTruth& seen = simulation.measured();
    EXPECT_EQ(seen.encoder_position, then.encoder_position);
    EXPECT_EQ(seen.imu_specific_force, then.imu_specific_force);
    EXPECT_EQ(seen.imu_angular_velocity, then.imu_angular_velocity);
    EXPECT_EQ(seen.foot_wrench[1], then.foot_wrench[1]);
    EXPECT_EQ(seen.motor_current, then.motor_current);
    EXPECT_EQ(seen.push_force, simulation.truth().push_force) << "not a sensor of the robot";
  }
  EXPECT_NE(past[39].encoder_position, past[38].encoder_position);
}

TEST(SensorDelay, TheSameWithWholeTicks) {
  EngineSimulation simulation(PaperRobot(), With("sensor_delay: 0.004"), kTick, 1);
  std::vector<VectorXd> past = {simulation.truth().encoder_position};
  for (size_t i = 1; i < 10; ++i) {
    simulation.Advance();
    past.push_back(simulation.truth().encoder_position);
    EXPECT_EQ(simulation.measured().encoder_position, past[i < 2 ? 0 : i - 2]);
  }
}

TEST(ElasticGear, StartsAtRestHoldingTheRobot) {
  EngineSimulation simulation(PaperRobot(),
                              With("gear_stiffness: 8000 gear_damping: 3 backlash: 0.001 "
                                   "torque_lag: 0.001"),
                              kTick, 1);
  const PostureHolder holder(simulation, 0, 0);
  const VectorXd start = simulation.truth().state.joint_position;
  for (int j = 0; j < 12; ++j) {
    const double torque = holder.statics()[j];
    EXPECT_NEAR(simulation.truth().encoder_position[j] - start[j],
                std::copysign(0.0005, torque) + torque / 8000, 1e-12);
    EXPECT_NEAR(simulation.truth().motor_torque[j], torque, 1e-10);
  }
  for (int i = 0; i < 25; ++i) {
    holder.Apply(&simulation);
    simulation.Advance();
  }
  EXPECT_LT((simulation.truth().state.joint_position - start).cwiseAbs().maxCoeff(), 2e-4)
      << "the feet settle; nothing jumps";
}

TEST(ElasticGear, TheMotorsEncoderIsBlindToIt) {
  for (const bool link : {false, true}) {
    EngineSimulation simulation(PaperRobot(),
                                With("gear_stiffness: 8000 gear_damping: 3 link_encoder: " +
                                     std::string(link ? "true" : "false")),
                                kTick, 1);
    Lift(&simulation);
    SetCurrent(2, &simulation);
    for (int i = 0; i < 10; ++i) simulation.Advance();
    const VectorXd difference =
        simulation.truth().encoder_position - simulation.truth().state.joint_position;
    if (link) {
      EXPECT_EQ(difference.norm(), 0);
    } else {
      EXPECT_GT(difference.cwiseAbs().minCoeff(), 1e-5);
    }
  }
}

// In flight the gears push on both of a joint's links: the COM falls as if they were not there, and
// the robot's spin stays nil.
TEST(ElasticGear, MovesNothingFromOutside) {
  EngineSimulation simulation(
      PaperRobot(), With("gear_stiffness: 20000 gear_damping: 5 backlash: 0.002"), kTick, 1);
  Lift(&simulation);
  const Vector3d start = simulation.truth().com;
  SetCurrent(0.7, &simulation);
  constexpr int kSteps = 200;
  for (int i = 0; i < kSteps; ++i) simulation.Step();
  const double h = simulation.step();
  Vector3d fallen = start;
  fallen.z() -= robot::kGravity * h * h * kSteps * (kSteps + 1) / 2;
  EXPECT_LT((simulation.truth().com - fallen).norm(), 1e-9);
  EXPECT_GT(simulation.truth().state.joint_velocity.norm(), 0.5);
}

// As stiff as can be, the rotor moves with the link: the rigid gear with its reflected inertia.
TEST(ElasticGear, StiffIsRigid) {
  std::vector<VectorXd> velocity;
  for (const std::string gear : {"", "gear_stiffness: 1e6 gear_damping: 300"}) {
    EngineSimulation simulation(PaperRobot(), With(gear), kTick, 1);
    Lift(&simulation);
    SetCurrent(1, &simulation);
    for (int i = 0; i < 50; ++i) simulation.Advance();
    velocity.push_back(simulation.truth().state.joint_velocity);
  }
  EXPECT_GT(velocity[0].norm(), 2);
  EXPECT_LT((velocity[1] - velocity[0]).norm(), 0.01 * velocity[0].norm());
}

// Determinism: an effect of size 0 leaves every bit as it is without a drive train.
TEST(DriveTrain, OffIsTheIdealOne) {
  std::vector<SimulationTruth> end;
  for (const std::string drive_train :
       {"",
        "drive_train { torque_lag: 0 current_resolution: 0 backlash: 0 gear_stiffness: 0 "
        "gear_damping: 7 link_encoder: true sensor_delay: 0 }"}) {
    EngineSimulation simulation(PaperRobot(), StandingConfig(drive_train), kTick, 1);
    const PostureHolder holder(simulation);
    for (int i = 0; i < 100; ++i) {
      holder.Apply(&simulation);
      simulation.Advance();
    }
    end.push_back(simulation.truth());
    EXPECT_EQ(&simulation.measured(), &simulation.truth());
    EXPECT_EQ(simulation.truth().encoder_position, simulation.truth().state.joint_position);
  }
  EXPECT_EQ(end[0].state.joint_position, end[1].state.joint_position);
  EXPECT_EQ(end[0].state.joint_velocity, end[1].state.joint_velocity);
  EXPECT_EQ(end[0].foot_wrench[0], end[1].foot_wrench[0]);
  EXPECT_EQ(end[0].motor_current, end[1].motor_current);
}

}  // namespace
}  // namespace poise
