// Rigid-body mechanics of the simulated robot away from contact, against closed forms, conservation
// laws and the equations of motion of components/robot (which share nothing with an engine).
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "components/robot_files/robot_files.h"
#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

robot::RobotState Lifted(const Simulation& simulation, double height) {
  robot::RobotState state = simulation.truth().state;
  state.base_position.z() += height;
  return state;
}

struct Dynamics {
  explicit Dynamics(const robot::RobotModel& model, const robot::RobotState& state) : data(model) {
    robot::ComputeKinematics(model, state, &data);
    robot::ComputeFeet(model, &data);
    robot::ComputeDynamics(model, state, &data);
    velocity = VectorXd(model.num_velocities());
    velocity << state.base_linear_velocity, state.base_angular_velocity, state.joint_velocity;
    momentum = data.mass_matrix * velocity;
    energy = 0.5 * velocity.dot(momentum) + model.total_mass() * robot::kGravity * data.com.z();
    spin = momentum.segment<3>(3) - (data.com - state.base_position).cross(momentum.head<3>());
  }
  robot::RobotData data;
  VectorXd velocity, momentum;
  double energy;
  Vector3d spin;  // angular momentum about the COM
};

TEST(Flight, FreeFallIsThatOfTheIntegrator) {
  EngineSimulation simulation(PaperRobot(), BareConfig(), kTick, 1);
  simulation.SetState(Lifted(simulation, 3));
  const Vector3d start = simulation.truth().com;
  const VectorXd joints = simulation.truth().state.joint_position;
  const double h = simulation.step();
  constexpr int kSteps = 500;
  for (int i = 0; i < kSteps; ++i) simulation.Step();
  const double g = robot::kGravity;
  EXPECT_NEAR(simulation.truth().com_velocity.z(), -g * h * kSteps, 1e-10);
  EXPECT_NEAR(simulation.truth().com.z() - start.z(), -g * h * h * kSteps * (kSteps + 1) / 2, 1e-9);
  EXPECT_LT((simulation.truth().com - start).head<2>().norm(), 1e-10);
  EXPECT_LT((simulation.truth().state.joint_position - joints).norm(), 1e-9);
  EXPECT_EQ(simulation.truth().contact_points[0] + simulation.truth().contact_points[1], 0);
  EXPECT_TRUE(simulation.truth().foot_wrench[0].isZero(0));
}

TEST(Flight, StateRoundTrip) {
  EngineSimulation simulation(PaperRobot(), BareConfig(), kTick, 1);
  robot::RobotState state = Lifted(simulation, 3);
  state.base_orientation = Eigen::AngleAxisd(0.7, Vector3d(1, 2, -0.5).normalized());
  state.base_linear_velocity = Vector3d(0.3, -0.2, 0.1);
  state.base_angular_velocity = Vector3d(-0.5, 0.4, 0.9);
  for (int j = 0; j < 12; ++j) state.joint_velocity[j] = 0.1 * (j - 5);
  simulation.SetState(state);
  const SimulationTruth& truth = simulation.truth();
  EXPECT_LT((truth.state.base_position - state.base_position).norm(), 1e-14);
  EXPECT_NEAR(std::abs(truth.state.base_orientation.dot(state.base_orientation)), 1, 1e-14);
  EXPECT_LT((truth.state.base_linear_velocity - state.base_linear_velocity).norm(), 1e-14);
  EXPECT_LT((truth.state.base_angular_velocity - state.base_angular_velocity).norm(), 1e-14);
  EXPECT_LT((truth.state.joint_position - state.joint_position).norm(), 1e-13);
  EXPECT_LT((truth.state.joint_velocity - state.joint_velocity).norm(), 1e-13);
  const Dynamics dynamics(simulation.model(), state);
  EXPECT_LT((truth.com - dynamics.data.com).norm(), 1e-13);
  EXPECT_LT((truth.com_velocity - dynamics.data.com_velocity).norm(), 1e-13);
  for (size_t f = 0; f < 2; ++f) {
    EXPECT_TRUE(truth.foot_pose[f].isApprox(dynamics.data.foot_pose[f], 1e-13));
  }
}

// From rest the velocity after one step is h A^-1 (S^T torque - g), whatever the step: no J̇ term is
// involved.
class FromRest : public ::testing::TestWithParam<bool> {};

TEST_P(FromRest, AccelerationsFollowTheEquationsOfMotion) {
  const bool rotor_inertia = GetParam();
  SimConfig config = BareConfig();
  config.set_rotor_inertia(rotor_inertia);
  config.set_step(1e-4);  // the bodies turn by 1e-5 rad before the velocities are read
  EngineSimulation simulation(PaperRobot(), config, kTick, 1);
  const robot::RobotModel model = rotor_inertia ? PaperRobot() : EditedRobot([](Robot* r) {
    for (auto& motor : *r->mutable_motor()) motor.set_rotor_inertia(0);
  });
  std::mt19937 random(TestSeed(2));
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    robot::RobotState state = Lifted(simulation, 5 - simulation.truth().state.base_position.z());
    state.base_linear_velocity.setZero();
    state.base_angular_velocity.setZero();
    state.joint_velocity.setZero();
    state.base_orientation =
        Eigen::Quaterniond(uniform(random), uniform(random), uniform(random), uniform(random));
    state.base_orientation.normalize();
    VectorXd torque(model.num_joints());
    for (int j = 0; j < model.num_joints(); ++j) {
      const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
      const double share = 0.5 + 0.45 * uniform(random);
      state.joint_position[j] = joint.lower + share * (joint.upper - joint.lower);
      torque[j] = 10 * uniform(random);
    }
    simulation.SetState(state);
    PostureHolder::ApplyTorque(torque, &simulation);
    simulation.Step();

    const Dynamics dynamics(model, state);
    VectorXd force = -dynamics.data.gravity;
    force.tail(model.num_joints()) += torque;
    const VectorXd expected = dynamics.data.mass_matrix.llt().solve(force);
    const VectorXd measured_joints = simulation.truth().state.joint_velocity / simulation.step();
    const Vector3d measured_spin =
        simulation.truth().state.base_angular_velocity / simulation.step();
    // |v'| h.
    EXPECT_LT((measured_joints - expected.tail(12)).norm(), 1e-4 * expected.norm())
        << "trial " << trial;
    EXPECT_LT((measured_spin - expected.segment<3>(3)).norm(), 1e-4 * expected.norm());
  }
}

INSTANTIATE_TEST_SUITE_P(RotorInertia, FromRest, ::testing::Bool());

TEST(Flight, MomentumAndEnergyAreKeptToFirstOrderOfTheStep) {
  for (const bool rotor_inertia : {false, true}) {
    const robot::RobotModel model = EditedRobot([&](Robot* r) {
      if (rotor_inertia) return;
      for (auto& motor : *r->mutable_motor()) motor.set_rotor_inertia(0);
    });
    std::vector<double> energy_error, spin_error;
    for (const double step : {1e-3, 5e-4, 2.5e-4}) {
      SimConfig config = BareConfig();
      config.set_rotor_inertia(true);
      config.set_step(step);
      EngineSimulation simulation(model, config, kTick, 1);
      robot::RobotState state = Lifted(simulation, 3);
      state.base_angular_velocity = Vector3d(0.8, -0.6, 1.1);
      for (int j = 0; j < 12; ++j) state.joint_velocity[j] = (j % 2 == 0 ? 0.7 : -0.9);
      simulation.SetState(state);
      const Vector3d com_velocity = simulation.truth().com_velocity;
      const Dynamics before(model, simulation.truth().state);
      double worst_energy = 0, worst_spin = 0;
      for (int i = 0; i < 100; ++i) {
        simulation.Advance();
        const Dynamics now(model, simulation.truth().state);
        // The integrator's own free fall gains m g h^2 n / 2 per step, exactly known.
        const double fall =
            model.total_mass() * robot::kGravity * robot::kGravity * step * simulation.time() / 2;
        worst_energy = std::max(worst_energy, std::abs(now.energy + fall - before.energy));
        worst_spin = std::max(worst_spin, (now.spin - before.spin).norm());
      }
      EXPECT_LT(
          (simulation.truth().com_velocity - com_velocity - Vector3d(0, 0, -robot::kGravity * 0.2))
              .norm(),
          1e-9);
      energy_error.push_back(worst_energy);
      spin_error.push_back(worst_spin);
    }
    const double kinetic = 20;  // J, of the order of this motion's
    EXPECT_LT(energy_error[0], 0.02 * kinetic);
    for (int i = 0; i < 2; ++i) {
      const auto k = static_cast<size_t>(i);
      EXPECT_NEAR(energy_error[k] / energy_error[k + 1], 2, 0.25) << energy_error[k];
      EXPECT_GT(spin_error[k] / spin_error[k + 1], 1.7) << spin_error[k];
    }
  }
}

TEST(Push, HalfSineImpulseIsExactWhateverTheStep) {
  for (const double step : {0.002, 0.0005}) {
    SimConfig config = BareConfig(
        "push { start: 0.1003 duration: 0.0917 peak: 188.91 direction_x: 3 direction_y: 4 "
        "point { z: 0.2 } }");
    config.set_step(step);
    EngineSimulation simulation(RigidRobot(), config, kTick, 1);
    simulation.SetState(Lifted(simulation, 3));
    double peak = 0;
    for (int i = 0; i < 150; ++i) {
      simulation.Advance();
      peak = std::max(peak, simulation.truth().push_force.norm());
    }
    const double impulse = 2 / std::numbers::pi * 188.91 * 0.0917;
    const Vector3d momentum = simulation.model().total_mass() * simulation.truth().com_velocity;
    EXPECT_NEAR(momentum.x(), 0.6 * impulse, 1e-8);
    EXPECT_NEAR(momentum.y(), 0.8 * impulse, 1e-8);
    EXPECT_NEAR(peak, 188.91, 0.2) << "the sensor sees the force of the instant";
    EXPECT_TRUE(simulation.truth().push_force.isZero(0)) << "and nothing afterwards";
  }
}

TEST(Push, RectangleOnALinkTurnsTheRobotAboutItsCom) {
  SimConfig config = BareConfig(
      "push { start: 0 duration: 0.01 peak: 50 direction_y: 1 profile: RECTANGLE "
      "link: 'left_foot' }");
  EngineSimulation simulation(RigidRobot(), config, kTick, 1);
  simulation.SetState(Lifted(simulation, 3));
  const Vector3d arm = simulation.truth().push_point - simulation.truth().com;
  EXPECT_NEAR(arm.z(), 0.105 - simulation.truth().com.z() + 3, 1e-6) << "ankle height";
  for (int i = 0; i < 5; ++i) simulation.Advance();
  const Dynamics now(simulation.model(), simulation.truth().state);
  const Vector3d impulse(0, 0.5, 0);
  const double mass = simulation.model().total_mass();
  EXPECT_LT((mass * simulation.truth().com_velocity - impulse).head<2>().norm(), 1e-9);
  EXPECT_LT((now.spin - arm.cross(impulse)).norm(), 2e-3 * arm.cross(impulse).norm());
}

TEST(Push, ScaledImpulseIsAShareOfMassAndHeight) {
  for (const double height : {0.70, 0.76}) {
    for (const char* profile : {"HALF_SINE", "RECTANGLE"}) {
      SimConfig config = BareConfig(
          "push { start: 0.1003 duration: 0.0917 scaled_impulse: 0.05 direction_x: 3 "
          "direction_y: 4 at_body: true profile: " +
          std::string(profile) + " }");
      config.mutable_start()->set_com_height(height);
      EngineSimulation simulation(RigidRobot(), config, kTick, 1);
      const double mass = simulation.model().total_mass();
      const Vector3d body =
          simulation.truth().state.base_position +
          simulation.truth().state.base_orientation * simulation.model().bodies()[0].com;
      EXPECT_LT((simulation.truth().push_point - body).norm(), 1e-12);
      simulation.SetState(Lifted(simulation, 3));
      for (int i = 0; i < 150; ++i) simulation.Advance();
      const double impulse = 0.05 * mass * std::sqrt(robot::kGravity * height);
      const Vector3d momentum = mass * simulation.truth().com_velocity;
      EXPECT_NEAR(momentum.x(), 0.6 * impulse, 1e-6);
      EXPECT_NEAR(momentum.y(), 0.8 * impulse, 1e-6);
    }
  }
}

TEST(Joints, StopsHoldAgainstFullTorque) {
  EngineSimulation simulation(PaperRobot(), StandingConfig(), kTick, 1);
  simulation.SetState(Lifted(simulation, 30));
  VectorXd torque = VectorXd::Zero(12);
  const int knee = simulation.model().FindJoint("right_knee_pitch");
  torque[knee] = 100;
  const double upper = simulation.model().joints()[static_cast<size_t>(knee)].upper;
  PostureHolder::ApplyTorque(torque, &simulation);
  double farthest = 0;
  for (int i = 0; i < 500; ++i) {
    simulation.Advance();
    farthest = std::max(farthest, simulation.truth().state.joint_position[knee]);
  }
  ASSERT_FALSE(simulation.broken()) << simulation.end_reason();
  EXPECT_GT(farthest, upper);
  EXPECT_LT(farthest, upper + 0.1) << "impact at full speed";
  EXPECT_NEAR(simulation.truth().state.joint_position[knee], upper, 0.01);
}

TEST(Joints, TurnsAreCounted) {
  std::string urdf = ReadFile(RobotFolder() + "dyros_legs.urdf");
  const size_t joint = urdf.find("\"right_hip_yaw\" type=\"revolute\"");
  ASSERT_NE(joint, std::string::npos);
  urdf.replace(urdf.find("revolute", joint), 8, "continuous");
  Robot description;
  ReadTextProto(RobotFolder() + "dyros_legs.pbtxt", &description);
  description.clear_drive_train();
  for (auto& motor : *description.mutable_motor()) {
    motor.set_viscous_friction(5);
    motor.set_coulomb_friction(0);
    motor.set_static_friction(0);
  }
  const robot::RobotModel model = robot::MakeRobot(description, urdf);
  EngineSimulation simulation(model, StandingConfig("step: 0.0005"), kTick, 1);
  robot::RobotState state = Lifted(simulation, 30);
  const int yaw = model.FindJoint("right_hip_yaw");
  state.joint_position[yaw] = 7;  // already more than a turn
  simulation.SetState(state);
  EXPECT_NEAR(simulation.truth().state.joint_position[yaw], 7, 1e-12);
  VectorXd torque = VectorXd::Zero(12);
  torque[yaw] = -50;
  PostureHolder::ApplyTorque(torque, &simulation);
  double position = 7;
  for (int i = 0; i < 3000; ++i) {
    simulation.Step();
    position += simulation.step() * simulation.truth().state.joint_velocity[yaw];
  }
  EXPECT_LT(position, -2 * std::numbers::pi);
  EXPECT_NEAR(simulation.truth().state.joint_position[yaw], position, 0.1);
}

TEST(Motors, CurrentIsLimitedByPeakAndEffort) {
  EngineSimulation simulation(PaperRobot(), StandingConfig(), kTick, 1);
  simulation.SetState(Lifted(simulation, 30));
  std::vector<double> current(12, 100);
  current[1] = -100;
  current[2] = 7;
  std::vector<int8_t> enabled(12, 1);
  enabled[3] = 0;
  simulation.SetCurrents(current, enabled);
  simulation.Step();
  const auto& joints = simulation.model().joints();
  const VectorXd& torque = simulation.truth().motor_torque;
  for (int j = 0; j < 12; ++j) {
    const double limit = std::min(150.0, joints[static_cast<size_t>(j)].effort);  // 50 * 0.1 * 30 A
    const double expected = j == 1 ? -limit : j == 2 ? 35 : j == 3 ? 0 : limit;
    EXPECT_NEAR(torque[j], expected, 1e-12) << joints[static_cast<size_t>(j)].name;
    EXPECT_NEAR(simulation.truth().motor_current[j], expected / 5, 1e-12);
  }
}

TEST(Posture, JointsReadWhatTheyWereSetToWhateverTheFramesOfTheLinks) {
  // Its link frames are turned against each other in the zero posture.
  const robot::RobotModel model =
      robot::LoadRobotFiles(POISE_SOURCE_DIR "/tests/robot/data/mantis.pbtxt");
  const std::unique_ptr<World> world = EngineWorlds()(model, 8, 1e-3);
  std::mt19937 random(TestSeed(3));
  std::uniform_real_distribution<double> angle(-1, 1);
  robot::RobotState state(model.num_joints());
  robot::RobotState read(model.num_joints());
  for (int i = 0; i < 20; ++i) {
    state.base_position = {angle(random), angle(random), 2};
    state.base_orientation = Eigen::Quaterniond(angle(random), angle(random), angle(random), 1);
    state.base_orientation.normalize();
    for (int j = 0; j < model.num_joints(); ++j) state.joint_position[j] = angle(random);
    world->SetState(state);
    world->GetState(&read);
    EXPECT_LT((read.joint_position - state.joint_position).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((read.base_position - state.base_position).norm(), 1e-12);
    EXPECT_LT(read.base_orientation.angularDistance(state.base_orientation), 1e-7);
  }
}

}  // namespace
}  // namespace poise
