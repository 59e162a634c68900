// What MuJoCo alone is told, and the laws that its world is made to obey, against closed forms and
// the equations of motion of components/robot.
#include "sim_mujoco/mujoco_world.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "tests/sim/simulation_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(MujocoConfig, ValuesOutOfRangeAreRefused) {
  const auto field = [](double time, double softness) -> std::string {
    MujocoConfig config;
    config.set_contact_time_constant(time);
    config.set_contact_softness(softness);
    try {
      MujocoWorlds(config);
    } catch (const ConfigError& error) {
      return error.field();
    }
    return "";
  };
  EXPECT_EQ(field(0.005, 1e-7), "");
  EXPECT_EQ(field(0, 1e-7), "contact_time_constant");
  EXPECT_EQ(field(0.005, -1), "contact_softness");
  EXPECT_EQ(field(std::numeric_limits<double>::quiet_NaN(), 1e-7), "contact_time_constant");
}

TEST(MujocoConfig, AStepLongerThanTheContactsTimeIsRefused) {
  MujocoConfig config;
  config.set_contact_time_constant(0.0005);
  const robot::RobotModel model = PaperRobot();
  EXPECT_NO_THROW(MujocoWorlds(config)(model, 8, 0.0005));
  EXPECT_THROW(MujocoWorlds(config)(model, 8, 0.001), ConfigError);
}

/// A state with the robot high above the ground, everything in motion.
robot::RobotState Moving(const robot::RobotModel& model, std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  robot::RobotState state(model.num_joints());
  const auto draw = [&] { return uniform(*random); };
  state.base_position = {draw(), draw(), 3};
  state.base_orientation = Eigen::Quaterniond(1, draw(), draw(), draw()).normalized();
  state.base_linear_velocity = {draw(), draw(), draw()};
  state.base_angular_velocity = {draw(), draw(), draw()};
  for (int j = 0; j < model.num_joints(); ++j) {
    const robot::Joint& joint = model.joints()[static_cast<size_t>(j)];
    state.joint_position[j] = joint.lower + (joint.upper - joint.lower) * (0.5 + 0.4 * draw());
    state.joint_velocity[j] = draw();
  }
  return state;
}

/// The robot's own mass matrix and forces, without rotors: rows of the joints carry them.
robot::RobotModel WithoutRotors() {
  return EditedRobot([](Robot* description) {
    for (auto& motor : *description->mutable_motor()) motor.set_rotor_inertia(0);
  });
}

// M (v' - v) / h + bias = torque + (velocity - qd') / cfm, for rows soft and stiff at once.
TEST(MujocoWorld, JointRowsAreLinearInTheVelocityAtTheStepsEnd) {
  const robot::RobotModel model = WithoutRotors();
  const double h = 1e-3;
  std::mt19937 random(TestSeed(5));
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto world = MujocoWorlds(MujocoConfig())(model, 8, h);
  robot::RobotData data(model);
  robot::RobotState after(model.num_joints());
  for (int trial = 0; trial < 20; ++trial) {
    const robot::RobotState state = Moving(model, &random);
    robot::ComputeKinematics(model, state, &data);
    robot::ComputeDynamics(model, state, &data);
    Eigen::MatrixXd matrix = data.mass_matrix / h;
    VectorXd velocity(model.num_velocities());
    velocity << state.base_linear_velocity, state.base_angular_velocity, state.joint_velocity;
    VectorXd force = matrix * velocity - data.gravity - data.bias;
    world->SetState(state);
    for (int j = 0; j < model.num_joints(); ++j) {
      JointRow row;
      row.active = j % 4 != 3;
      row.cfm = std::pow(10, -j);
      row.velocity = uniform(random);
      row.torque = 20 * uniform(random);
      world->SetJoint(j, row);
      force[6 + j] += row.torque;
      if (!row.active) continue;
      force[6 + j] += row.velocity / row.cfm;
      matrix(6 + j, 6 + j) += 1 / row.cfm;
    }
    ASSERT_TRUE(world->Step()) << world->message();
    world->GetState(&after);
    const VectorXd expected = matrix.llt().solve(force).tail(model.num_joints());
    EXPECT_LT((after.joint_velocity - expected).lpNorm<Eigen::Infinity>(), 1e-8) << trial;
  }
}

// A robot of stiff joints on points that are springs and dampers: implicit Euler's own recursion,
// m (v' - v) / h = n (k (depth - h v') - d v') - m g, step by step from a drop.
TEST(MujocoWorld, SoftContactsAreSpringsAndDampersUnderImplicitEuler) {
  const robot::RobotModel model = RigidRobot();
  const double h = 1e-3, k = 5000, d = 20;
  constexpr int kPoints = 4;
  const auto world = MujocoWorlds(MujocoConfig())(model, kPoints, h);
  robot::RobotState state(model.num_joints());
  state.base_position.z() = 2;
  world->SetState(state);
  Vector3d com = Vector3d::Zero();
  for (int b = 0; b < static_cast<int>(model.bodies().size()); ++b) {
    com +=
        model.bodies()[static_cast<size_t>(b)].mass / model.total_mass() * world->com_position(b);
  }
  double depth = 0, v = -0.3;  // m, m/s
  state.base_linear_velocity.z() = v;
  world->SetState(state);
  const double m = model.total_mass();
  const JointRow locked{true, 0, 1e-9, 0};
  for (int i = 0; i < 100 && depth >= 0; ++i) {
    for (int j = 0; j < model.num_joints(); ++j) world->SetJoint(j, locked);
    const double z = world->pose(0).translation().z();
    for (int c = 0; c < kPoints; ++c) {
      const Vector3d arm((c & 1 ? -0.1 : 0.1), (c & 2 ? -0.1 : 0.1), 0);
      const Vector3d point = com + arm + Vector3d(0, 0, z - 2);
      world->AddContact({0, point, Vector3d::UnitZ(), depth, 0, {0.5, k, d}});
    }
    ASSERT_TRUE(world->Step()) << world->message();
    const double before = v;
    v = (m * v / h + kPoints * k * depth - m * robot::kGravity) / (m / h + kPoints * (h * k + d));
    double sum = 0;
    for (int c = 0; c < kPoints; ++c) sum += world->contact_force(c).z();
    const double expected = m * ((v - before) / h + robot::kGravity);
    if (expected < 0) break;  // it leaves the springs
    EXPECT_NEAR(sum, expected, 1e-4 * m * robot::kGravity) << i;
    depth -= h * v;
    EXPECT_NEAR(world->pose(0).translation().z(), 2 - depth, 1e-8) << i;
  }
}

/// One foot's four corners on rigid level ground, the robot stiff and sliding with (vx, vy).
struct Slide {
  Vector3d force = Vector3d::Zero();
  Vector3d velocity;
  int solutions;
};

Slide SlideOneStep(const ContactMaterial& material, double vx, double vy, double load) {
  const robot::RobotModel model = RigidRobot();
  const auto world = MujocoWorlds(MujocoConfig())(model, 4, 1e-3);
  robot::RobotState state(model.num_joints());
  state.base_position.z() = 2;
  state.base_linear_velocity = {vx, vy, 0};
  world->SetState(state);
  Vector3d com = Vector3d::Zero();
  for (int b = 0; b < static_cast<int>(model.bodies().size()); ++b) {
    com +=
        model.bodies()[static_cast<size_t>(b)].mass / model.total_mass() * world->com_position(b);
  }
  for (int j = 0; j < model.num_joints(); ++j) world->SetJoint(j, {true, 0, 1e-9, 0});
  // At the COM's height: friction then does not turn the robot.
  for (int c = 0; c < 4; ++c) {
    const Vector3d arm((c & 1 ? -0.1 : 0.1), (c & 2 ? -0.1 : 0.1), 0);
    world->AddContact({0, com + arm, Vector3d::UnitZ(), 0, 0, material});
  }
  world->AddForce(0, {0, 0, -load}, com);
  EXPECT_TRUE(world->Step()) << world->message();
  Slide slide;
  for (int c = 0; c < 4; ++c) slide.force += world->contact_force(c);
  slide.velocity = world->com_velocity(0);
  slide.solutions = static_cast<const MujocoWorld&>(*world).solutions();
  return slide;
}

// Coulomb: mu N against the slip, in every direction, and N is what carries the weight and the
// load, however fast it slides. MuJoCo's own cone would throw the robot up at mu times the slip.
TEST(MujocoWorld, SlidingSolesObeyCoulombsLaw) {
  const double mass = RigidRobot().total_mass();
  // In its first step the ground yields at softness times force: m v' = -m softness N / 4.
  const double yield = 1 + mass * MujocoConfig().contact_softness() / 4 / 1e-3;
  for (const double mu : {0.1, 0.9}) {
    for (const double speed : {0.05, 1.0, 5.0}) {
      for (const double angle : {0.0, 0.5, 0.785, 2.0}) {
        for (const double load : {0.0, 300.0}) {
          const Vector3d along(std::cos(angle), std::sin(angle), 0);
          const Slide slide = SlideOneStep({mu, 0, 0}, speed * along.x(), speed * along.y(), load);
          const double normal = (mass * robot::kGravity + load) / yield;
          EXPECT_NEAR(slide.force.z(), normal, 1e-6 * normal);
          EXPECT_LT((slide.force.head<2>() + mu * normal * along.head<2>()).norm(), 1e-6 * normal)
              << mu << " " << speed << " " << angle;
          EXPECT_NEAR(slide.velocity.z(), 0, 1e-4);
          EXPECT_LE(slide.solutions, 10);
        }
      }
    }
  }
}

// Both feet on tilted ground, all joints in motion: each point's way over the whole step, read from
// the bodies' poses, obeys Signorini's and Coulomb's law with its forces.
TEST(MujocoWorld, EveryPointObeysItsLawOverTheStepsWholeWay) {
  const robot::RobotModel model = PaperRobot();
  const double h = 2e-4, softness = 1e-4;
  constexpr double kTolerance = 2e-5;  // m/s, beside what an impact's change of velocity turns
  MujocoConfig config;
  config.set_contact_softness(softness);
  const auto world = MujocoWorlds(config)(model, 8, h);
  std::mt19937 random(TestSeed(7));
  std::uniform_real_distribution<double> uniform(-1, 1);
  int open = 0, stuck = 0, sliding = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const double mu = std::array{0.1, 0.6, 0.9, 1.5}[static_cast<size_t>(trial % 4)];
    robot::RobotState state = Moving(model, &random);
    if (trial % 3 == 0) {  // so slow that most points stick
      state.base_linear_velocity *= 1e-3;
      state.base_angular_velocity *= 1e-3;
      state.joint_velocity *= 1e-3;
    }
    world->SetState(state);
    for (int j = 0; j < model.num_joints(); ++j) world->SetJoint(j, {true, 0, h / 0.1, 0});
    std::vector<TerrainContact> contacts;
    std::vector<Vector3d> in_body;
    for (const robot::FootModel& foot : model.feet()) {
      const Eigen::Isometry3d sole = world->pose(foot.body) * foot.sole;
      for (int c = 0; c < 4; ++c) {
        const Vector3d corner((c & 1 ? -0.5 : 0.5) * foot.length, (c & 2 ? -0.5 : 0.5) * foot.width,
                              0);
        const Vector3d normal =
            (sole.linear().col(2) + 0.1 * Vector3d(uniform(random), uniform(random), 0))
                .normalized();
        contacts.push_back(
            {foot.body, sole * corner, normal, 1e-4 * uniform(random), 0, {mu, 0, 0}});
        in_body.push_back(foot.sole * corner);
        world->AddContact(contacts.back());
      }
    }
    ASSERT_TRUE(world->Step()) << world->message();
    robot::RobotState after(model.num_joints());
    world->GetState(&after);
    const double tolerance =
        kTolerance + h * ((after.joint_velocity - state.joint_velocity).norm() +
                          (after.base_angular_velocity - state.base_angular_velocity).norm());
    for (size_t c = 0; c < contacts.size(); ++c) {
      const TerrainContact& at = contacts[c];
      const Vector3d way = (world->pose(at.body) * in_body[c] - at.position) / h;
      const Vector3d force = world->contact_force(static_cast<int>(c));
      const double normal = at.normal.dot(force);
      const Vector3d tangential = force - normal * at.normal;
      const Vector3d slip = way - at.normal.dot(way) * at.normal;
      const double target = at.depth / (at.depth < 0 ? h : config.contact_time_constant());
      const double beyond = at.normal.dot(way) - target;  // m/s, that the force has to make up for
      if (normal == 0) {
        ++open;
        EXPECT_GT(beyond, -tolerance);
        continue;
      }
      EXPECT_GT(normal, 0);
      EXPECT_NEAR(beyond, -softness * normal, tolerance) << trial << " " << c;
      EXPECT_LT(tangential.norm(), mu * normal * (1 + 1e-6));
      if (slip.norm() < 20 * tolerance) {
        ++stuck;
        continue;
      }
      ++sliding;
      EXPECT_LT((tangential + mu * normal * slip.normalized()).norm(), 0.1 * mu * normal)
          << trial << " " << c << " " << slip.norm();
    }
  }
  EXPECT_EQ(static_cast<const MujocoWorld&>(*world).unsolved_steps(), 0);
  EXPECT_GT(open, 100);
  EXPECT_GT(stuck, 100);
  EXPECT_GT(sliding, 100);
}

// The robot turns above a foot that stands, at constant joint velocities: the foot stays where it
// is, though J̇ v would carry its points off by h² / 2 of it, some 1e-6 m a step.
TEST(MujocoWorld, AFootThatStandsStaysWhileTheRobotTurnsAboveIt) {
  const robot::RobotModel model = PaperRobot();
  const double h = 1e-3;
  const auto world = MujocoWorlds(MujocoConfig())(model, 4, h);
  robot::RobotState state(model.num_joints());
  for (int j = 0; j < model.num_joints(); ++j) state.joint_velocity[j] = j % 2 == 0 ? 1 : -1.5;
  robot::RobotData data(model);
  robot::ComputeKinematics(model, state, &data);
  robot::ComputeFeet(model, &data);
  // The base moves so that the right foot does not.
  const Eigen::MatrixXd& jacobian = data.foot_jacobian[0];
  const robot::Vector6d base =
      jacobian.leftCols<6>().partialPivLu().solve(-jacobian.rightCols(12) * state.joint_velocity);
  state.base_linear_velocity = base.head<3>();
  state.base_angular_velocity = base.tail<3>();
  world->SetState(state);
  const robot::FootModel& foot = model.feet()[0];
  const Eigen::Isometry3d sole = world->pose(foot.body) * foot.sole;
  for (int j = 0; j < model.num_joints(); ++j) {
    world->SetJoint(j, {true, state.joint_velocity[j], 1e-9, 0});
  }
  for (int c = 0; c < 4; ++c) {
    const Vector3d corner((c & 1 ? -0.5 : 0.5) * foot.length, (c & 2 ? -0.5 : 0.5) * foot.width, 0);
    world->AddContact({foot.body, sole * corner, sole.linear().col(2), 0, 0, {5, 0, 0}});
  }
  world->AddForce(foot.body, -5000 * sole.linear().col(2), sole.translation());
  ASSERT_TRUE(world->Step()) << world->message();
  const Eigen::Isometry3d after = world->pose(foot.body) * foot.sole;
  // Into the ground by softness times force, and no further.
  const double yield = h * MujocoConfig().contact_softness() * 5000;
  EXPECT_LT((after.translation() - sole.translation()).norm(), yield);
  EXPECT_GT(h * h / 2 * data.foot_bias_acceleration[0].norm(), 1e-6)
      << "the test would see nothing";
}

TEST(MujocoWorld, WithoutFrictionNothingHoldsSideways) {
  const Slide slide = SlideOneStep({0, 0, 0}, 0.5, 0.1, 0);
  EXPECT_NEAR(slide.force.z(), RigidRobot().total_mass() * robot::kGravity, 1);
  EXPECT_EQ(slide.force.x(), 0);
  EXPECT_EQ(slide.force.y(), 0);
}

// A point that sticks creeps sideways at softness times force, and no more.
TEST(MujocoWorld, SticksBelowTheCone) {
  const Slide slide = SlideOneStep({0.9, 0, 0}, 0.001, 0, 0);
  const double stop = RigidRobot().total_mass() * 0.001 / 1e-3;  // N, that stops it in a step
  EXPECT_NEAR(slide.force.x(), -stop, 0.01 * stop);
  constexpr double kSoftness = 1e-9;  // m/(N·s)
  EXPECT_LT(std::abs(slide.velocity.x()), 2 * stop / 4 * kSoftness);
}

// The ground yields by what its softness says, whatever the step.
TEST(MujocoConfig, SoftensTheGround) {
  MujocoConfig config;
  config.set_contact_softness(1e-5);
  for (const double time : {0.005, 0.01}) {
    config.set_contact_time_constant(time);
    for (const double step : {0.001, 0.0005}) {
      SimConfig sim = StandingConfig();
      sim.set_step(step);
      Simulation simulation(RigidRobot(), sim, MujocoWorlds(config), kTick, 1);
      const double start = simulation.truth().com.z();
      for (int i = 0; i < 1000; ++i) simulation.Advance();
      const double weight = simulation.model().total_mass() * robot::kGravity;
      const double sink = weight / 8 * 1e-5 * time;
      EXPECT_NEAR(start - simulation.truth().com.z(), sink, 0.02 * sink);
    }
  }
}

TEST(MujocoWorld, ContactsBeyondItsRoomAreDropped) {
  const robot::RobotModel model = PaperRobot();
  const auto world = MujocoWorlds(MujocoConfig())(model, 1, 1e-3);
  const TerrainContact contact{0, Vector3d::Zero(), Vector3d::UnitZ(), 0, 0, {0.5, 0, 0}};
  world->AddContact(contact);
  world->AddContact(contact);
  EXPECT_TRUE(world->Step()) << world->message();
}

}  // namespace
}  // namespace poise
