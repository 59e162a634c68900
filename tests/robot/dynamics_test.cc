// Dynamics against finite differences, conservation laws and Newton–Euler body by body.
#include "components/robot/dynamics.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "tests/robot/robot_test_support.h"
#include "tests/test_seed.h"

namespace poise::robot {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kStates = 100;

class DynamicsTest : public testing::TestWithParam<TestRobot> {
 protected:
  DynamicsTest() : model_(LoadTestRobot(GetParam())) {}

  Eigen::VectorXd RandomVector() {
    std::uniform_real_distribution<double> uniform(-5, 5);
    VectorXd v(model_.num_velocities());
    for (double& x : v) x = uniform(random_);
    return v;
  }

  RobotModel model_;
  std::mt19937 random_{TestSeed(3)};
};

void ExpectClose(const VectorXd& actual, const VectorXd& expected, double tolerance,
                 const char* what) {
  EXPECT_LE((actual - expected).norm(), tolerance * (1 + expected.norm())) << what;
}

TEST_P(DynamicsTest, VelocitiesAreDerivativesOfPositions) {
  const double h = 1e-6;
  for (int i = 0; i < kStates; ++i) {
    const RobotState state = RandomState(model_, &random_);
    const RobotData now = Evaluate(model_, state);
    const RobotData after = Evaluate(model_, Moved(state, Velocity(state), h));
    const RobotData before = Evaluate(model_, Moved(state, Velocity(state), -h));
    ExpectClose(now.com_velocity, (after.com - before.com) / (2 * h), 1e-7, "COM");
    ExpectClose(now.com_velocity, now.com_jacobian * Velocity(state), 1e-13, "COM Jacobian");
    for (size_t f = 0; f < 2; ++f) {
      Vector6d velocity;
      const Eigen::AngleAxisd turn(after.foot_pose[f].linear() *
                                   before.foot_pose[f].linear().transpose());
      velocity << after.foot_pose[f].translation() - before.foot_pose[f].translation(),
          turn.angle() * turn.axis();
      ExpectClose(now.foot_velocity[f], velocity / (2 * h), 1e-6, "foot");
      ExpectClose(now.foot_velocity[f], now.foot_jacobian[f] * Velocity(state), 1e-13,
                  "foot Jacobian");
    }
  }
}

TEST_P(DynamicsTest, BiasAccelerationsAreJdotV) {
  const double h = 1e-5;
  for (int i = 0; i < kStates; ++i) {
    const RobotState state = RandomState(model_, &random_);
    const VectorXd v = Velocity(state);
    const RobotData now = Evaluate(model_, state);
    const RobotData after = Evaluate(model_, Moved(state, v, h));
    const RobotData before = Evaluate(model_, Moved(state, v, -h));
    ExpectClose(now.com_bias_acceleration, (after.com_jacobian - before.com_jacobian) * v / (2 * h),
                1e-6, "COM");
    for (size_t f = 0; f < 2; ++f) {
      ExpectClose(now.foot_bias_acceleration[f],
                  (after.foot_jacobian[f] - before.foot_jacobian[f]) * v / (2 * h), 1e-6, "foot");
    }
    for (size_t b = 0; b < model_.bodies().size(); ++b) {
      ExpectClose(now.body_linear_bias[b],
                  (after.body_linear_velocity[b] - before.body_linear_velocity[b]) / (2 * h), 1e-6,
                  "body, linear");
      ExpectClose(now.body_angular_bias[b],
                  (after.body_angular_velocity[b] - before.body_angular_velocity[b]) / (2 * h),
                  1e-6, "body, angular");
    }
  }
}

TEST_P(DynamicsTest, MassMatrixIsSymmetricAndPositiveDefinite) {
  for (int i = 0; i < kStates; ++i) {
    const RobotData data = Evaluate(model_, RandomState(model_, &random_));
    EXPECT_EQ(data.mass_matrix, data.mass_matrix.transpose());
    EXPECT_EQ(data.mass_matrix.llt().info(), Eigen::Success);
  }
}

TEST_P(DynamicsTest, InverseDynamicsAgrees) {
  for (int i = 0; i < kStates; ++i) {
    const RobotState state = RandomState(model_, &random_);
    const RobotData data = Evaluate(model_, state);
    const VectorXd acceleration = RandomVector();
    VectorXd force(model_.num_velocities());
    InverseDynamics(model_, state, data, acceleration, force);
    ExpectClose(data.mass_matrix * acceleration + data.bias + data.gravity, force, 1e-12,
                "A v' + b + g");
  }
}

// Dropped without torque: what a step of the motion gives.
struct Motion {
  VectorXd velocity, acceleration;
};
Motion FreeMotion(const RobotModel& model, const RobotState& state, bool gravity) {
  const RobotData data = Evaluate(model, state);
  VectorXd force = -data.bias;
  if (gravity) force -= data.gravity;
  return {Velocity(state), data.mass_matrix.llt().solve(force)};
}

// Fourth-order Runge–Kutta, but for orientations, whose averaged angular velocities leave a lower
// order: the error still vanishes with the step.
RobotState Stepped(const RobotModel& model, const RobotState& state, double h, bool gravity) {
  const auto at = [&](const Motion& m, double time) {
    RobotState s = Moved(state, m.velocity, time);
    SetVelocity(Velocity(state) + time * m.acceleration, &s);
    return s;
  };
  const Motion k1 = FreeMotion(model, state, gravity);
  const Motion k2 = FreeMotion(model, at(k1, h / 2), gravity);
  const Motion k3 = FreeMotion(model, at(k2, h / 2), gravity);
  const Motion k4 = FreeMotion(model, at(k3, h), gravity);
  const VectorXd velocity = (k1.velocity + 2 * k2.velocity + 2 * k3.velocity + k4.velocity) / 6;
  const VectorXd acceleration =
      (k1.acceleration + 2 * k2.acceleration + 2 * k3.acceleration + k4.acceleration) / 6;
  RobotState next = Moved(state, velocity, h);
  SetVelocity(Velocity(state) + h * acceleration, &next);
  return next;
}

double Energy(const RobotModel& model, const RobotState& state, bool gravity) {
  const RobotData data = Evaluate(model, state);
  const VectorXd v = Velocity(state);
  return 0.5 * v.dot(data.mass_matrix * v) +
         (gravity ? model.total_mass() * kGravity * data.com.z() : 0);
}

TEST_P(DynamicsTest, FreeMotionConservesEnergy) {
  for (const bool gravity : {true, false}) {
    RobotState state = RandomState(model_, &random_);
    SetVelocity(0.3 * Velocity(state), &state);
    const double before = Energy(model_, state, gravity);
    const double kinetic = Energy(model_, state, false);
    // The error must vanish with the step, so it is the integrator's and not the model's.
    double error[2];
    for (int refinement = 0; refinement < 2; ++refinement) {
      const int steps = 200 << (2 * refinement);
      RobotState s = state;
      for (int i = 0; i < steps; ++i) s = Stepped(model_, s, 0.1 / steps, gravity);
      error[refinement] = std::abs(Energy(model_, s, gravity) - before) / kinetic;
    }
    EXPECT_LT(error[1], 1e-6);
    EXPECT_LT(error[1], 0.1 * error[0] + 1e-12);
  }
}

TEST_P(DynamicsTest, FreeMotionConservesMomentum) {
  RobotState state = RandomState(model_, &random_);
  SetVelocity(0.3 * Velocity(state), &state);
  const auto momentum = [&](const RobotState& s) {
    const RobotData data = Evaluate(model_, s);
    Vector6d p = data.mass_matrix.topRows<6>() * Velocity(s);
    p.tail<3>() += s.base_position.cross(Vector3d(p.head<3>()));  // about the world origin
    return p;
  };
  const Vector6d before = momentum(state);
  for (int i = 0; i < 800; ++i) state = Stepped(model_, state, 0.1 / 800, false);
  ExpectClose(momentum(state), before, 1e-7, "momentum");
}

TEST_P(DynamicsTest, GravityIsTheSlopeOfPotentialEnergy) {
  const RobotState state = RandomState(model_, &random_);
  const RobotData data = Evaluate(model_, state);
  const double h = 1e-6;
  for (int i = 0; i < model_.num_velocities(); ++i) {
    const VectorXd along = VectorXd::Unit(model_.num_velocities(), i);
    const double slope = (Evaluate(model_, Moved(state, along, h)).com.z() -
                          Evaluate(model_, Moved(state, along, -h)).com.z()) /
                         (2 * h) * model_.total_mass() * kGravity;
    EXPECT_NEAR(data.gravity[i], slope, 1e-5 * (1 + std::abs(slope)));
  }
}

TEST_P(DynamicsTest, SameFarFromTheWorldOrigin) {
  for (int i = 0; i < kStates; ++i) {
    RobotState state = RandomState(model_, &random_);
    const RobotData near = Evaluate(model_, state);
    state.base_position += Vector3d(1e6, -1e6, 1e6);
    const RobotData far = Evaluate(model_, state);
    EXPECT_EQ(far.mass_matrix, near.mass_matrix);
    EXPECT_EQ(far.bias, near.bias);
    EXPECT_EQ(far.gravity, near.gravity);
    EXPECT_EQ(far.com_jacobian, near.com_jacobian);
    EXPECT_EQ(far.com_bias_acceleration, near.com_bias_acceleration);
    for (size_t f = 0; f < 2; ++f) {
      EXPECT_EQ(far.foot_jacobian[f], near.foot_jacobian[f]);
      EXPECT_EQ(far.foot_bias_acceleration[f], near.foot_bias_acceleration[f]);
    }
  }
}

TEST_P(DynamicsTest, ReusedDataGivesTheSameBits) {
  RobotData data = Evaluate(model_, RandomState(model_, &random_));
  const RobotState state = RandomState(model_, &random_);
  ComputeKinematics(model_, state, &data);
  ComputeFeet(model_, &data);
  ComputeDynamics(model_, state, &data);
  const RobotData fresh = Evaluate(model_, state);
  EXPECT_EQ(data.mass_matrix, fresh.mass_matrix);
  EXPECT_EQ(data.bias, fresh.bias);
  EXPECT_EQ(data.foot_jacobian[1], fresh.foot_jacobian[1]);
}

TEST_P(DynamicsTest, NonFiniteInputGivesNonFiniteOutput) {
  RobotState state = RandomState(model_, &random_);
  const int last = model_.num_joints() - 1;
  state.joint_position[last] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Evaluate(model_, state).mass_matrix.allFinite());
  state = RandomState(model_, &random_);
  state.joint_velocity[0] = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(Evaluate(model_, state).bias.allFinite());
}

TEST_P(DynamicsTest, ModelErrorMovesWhatItSays) {
  const RobotState state = RandomState(model_, &random_);
  const RobotData nominal = Evaluate(model_, state);
  const size_t b = 3;
  const Body& body = model_.bodies()[b];
  const Vector3d shift(0.01, -0.02, 0.03);
  const RobotModel changed = model_.WithModelError(body.name, 1.5, shift);
  const RobotData data = Evaluate(changed, state);
  EXPECT_NEAR(changed.total_mass(), model_.total_mass() + 0.5 * body.mass, 1e-12);
  const Vector3d arm = nominal.base_position + nominal.body_position[b];
  const Vector3d old_com = arm + nominal.body_rotation[b] * body.com;
  const Vector3d new_com = arm + nominal.body_rotation[b] * (body.com + shift);
  const Vector3d expected =
      (model_.total_mass() * nominal.com - body.mass * old_com + 1.5 * body.mass * new_com) /
      changed.total_mass();
  EXPECT_LT((data.com - expected).norm(), 1e-12);
  EXPECT_LT((changed.bodies()[b].inertia - 1.5 * body.inertia).norm(), 1e-15);
}

INSTANTIATE_TEST_SUITE_P(Robots, DynamicsTest,
                         testing::Values(TestRobot::kDyros, TestRobot::kMantis),
                         [](const auto& test) {
                           return test.param == TestRobot::kDyros ? "dyros" : "mantis";
                         });

}  // namespace
}  // namespace poise::robot
