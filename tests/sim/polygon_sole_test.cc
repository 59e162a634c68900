// Soles of any convex shape on ground and block, against statics.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/sim/engine.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

/// The rigid robot on regular polygons of `n` corners at the distance `radius` (m), the first
/// ahead.
robot::RobotModel OnPolygons(int n, double radius) {
  return EditedRobot([&](Robot* description) {
    for (Motor& motor : *description->mutable_motor()) {
      motor.set_viscous_friction(1e9);
      motor.set_coulomb_friction(0);
      motor.set_static_friction(0);
    }
    for (Foot& foot : *description->mutable_foot()) {
      foot.clear_length();
      foot.clear_width();
      for (int i = 0; i < n; ++i) {
        SoleVertex* vertex = foot.add_vertex();
        vertex->set_x(radius * std::cos(2 * pi * i / n));
        vertex->set_y(radius * std::sin(2 * pi * i / n));
      }
    }
  });
}

/// On a soft block under both feet, settled.
SimulationTruth Settled(const robot::RobotModel& model, double stiffness, double com_x) {
  SimConfig config = StandingConfig();
  config.mutable_start()->set_com_x(com_x);
  SoftBlock* block = config.mutable_block();
  block->set_length(1);
  block->set_width(1);
  block->set_height(0.09);
  block->set_stiffness(stiffness);
  block->set_damping(6000);  // soon at rest: half of critical when it tilts
  block->set_start(1e-6);
  EngineSimulation simulation(model, config, kTick, 1);
  robot::RobotState state = simulation.truth().state;
  state.base_position.z() += 0.09;
  simulation.SetState(state);
  for (int i = 0; i < 2000; ++i) simulation.Advance();
  EXPECT_FALSE(simulation.fallen()) << simulation.end_reason();
  return simulation.truth();
}

// The whole sole has the block's stiffness, however many corners share it.
TEST(PolygonSole, SinksByItsShareOfTheWeight) {
  constexpr double kStiffness = 30000;
  for (const int n : {3, 16}) {
    const robot::RobotModel model = OnPolygons(n, 0.15);
    const SimulationTruth truth = Settled(model, kStiffness, 0);
    const double weight = model.total_mass() * robot::kGravity;
    EXPECT_EQ(truth.contact_points[0], n);
    EXPECT_NEAR(truth.foot_pose[0].translation().z(), 0.09 - weight / (2 * kStiffness), 2e-5);
    EXPECT_NEAR(truth.foot_wrench[0][2] + truth.foot_wrench[1][2], weight, 0.01);
  }
}

// Springs at the corners of a regular polygon turn with k r² / 2 about any axis of a sole, and the
// weight turns on with m g h: the body tilts by m g c / (k r² - m g h), c ahead of the centre.
TEST(PolygonSole, TiltsAsTheSpringsAtItsCorners) {
  constexpr double kStiffness = 60000, kRadius = 0.15, kAhead = 0.008;
  for (const int n : {3, 6}) {
    const robot::RobotModel model = OnPolygons(n, kRadius);
    const SimulationTruth truth = Settled(model, kStiffness, kAhead);
    const double weight = model.total_mass() * robot::kGravity;
    const double height = truth.com.z() - truth.foot_pose[0].translation().z();
    const double expected = weight * kAhead / (kStiffness * kRadius * kRadius - weight * height);
    const double tilt = std::asin(-truth.foot_pose[0].linear()(2, 0));
    EXPECT_NEAR(tilt, expected, 0.03 * expected) << n;
  }
}

// On one foot it stands while the COM is over the sole, and tips over the edge that it is beyond.
TEST(PolygonSole, TipsOverTheEdgeBeyondWhichItsMassIs) {
  constexpr double kRadius = 0.12, kInner = kRadius / 2;  // of the triangle
  const robot::RobotModel model = OnPolygons(3, kRadius);
  for (const double angle : {pi, pi / 3, -pi / 3}) {
    for (const double beyond : {-0.004, 0.004}) {
      const Vector2d com =
          (kInner + beyond) * Vector2d(std::cos(angle), std::sin(angle)) - Vector2d(0, 0.105);
      SimConfig config = StandingConfig();
      config.mutable_start()->set_left_foot_height(0.1);
      config.mutable_start()->set_com_x(com.x());
      config.mutable_start()->set_com_y(com.y());
      EngineSimulation simulation(model, config, kTick, 1);
      EXPECT_EQ(simulation.truth().contact_points[0], 3);
      for (int i = 0; i < 500; ++i) simulation.Advance();
      const double moved = (simulation.truth().com.head<2>() - com).norm();
      // The pendulum's distance from the edge grows by cosh(ω t), here some 20 times.
      if (beyond < 0) {
        EXPECT_LT(moved, 5e-4) << angle;
      } else {
        EXPECT_GT(moved, 0.02) << angle;
        // Across the edge, not along it.
        const Vector2d way = (simulation.truth().com.head<2>() - com).normalized();
        EXPECT_GT(way.dot(Vector2d(std::cos(angle), std::sin(angle))), 0.9) << angle;
      }
    }
  }
}

}  // namespace
}  // namespace poise
