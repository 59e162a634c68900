// The rungs between physics and the robot against what must hold of any of them.
#include "tools/sweep/step_ladder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "components/balance/support_polygon.h"
#include "components/robot/posture.h"
#include "components/step_planner/recovery_config.h"
#include "tests/robot/robot_test_support.h"

namespace poise {
namespace {

constexpr double kPeriod = 0.002;  // s

using Eigen::Vector2d;

class StepLadderTest : public testing::TestWithParam<robot::TestRobot> {
 protected:
  const robot::RobotModel model_ = robot::LoadTestRobot(GetParam());
  const StepLadder ladder_{model_};

  PushProfile Of(double impulse, const Vector2d& direction) const {
    Push push;
    push.set_start(0.1);
    push.set_duration(0.01);
    push.set_scaled_impulse(impulse / ladder_.impulse_scale());
    push.set_direction_x(direction.x());
    push.set_direction_y(direction.y());
    push.set_at_body(true);
    return {push, model_, ladder_.impulse_scale(), "push"};
  }
  std::vector<Vector2d> directions() const {
    std::vector<Vector2d> all;
    for (int i = 0; i < 8; ++i) all.emplace_back(std::cos(i * M_PI / 4), std::sin(i * M_PI / 4));
    return all;
  }
};

TEST_P(StepLadderTest, ThePlannerCatchesWhatSolesStopAndNothingBeyondTheBound) {
  for (const Vector2d& direction : directions()) {
    const double bound = ladder_.Bound(direction);
    // What the capture point of a push within the soles' inscribed circle asks for.
    const double frequency = std::sqrt(robot::kGravity / robot::StandingHeight(model_));
    const double radius = 0.5 * model_.feet()[0].width - 0.01;
    const double stands = 0.9 * model_.total_mass() * frequency * radius;
    EXPECT_TRUE(ladder_.Survives(Of(stands, direction), kPeriod, 4)) << direction.transpose();
    EXPECT_FALSE(ladder_.Survives(Of(bound, direction), kPeriod, 8)) << direction.transpose();
  }
}

// The closed form of steps that go on for ever, of a robot that is the same on both sides: ahead
// all steps are as long.
TEST_P(StepLadderTest, AheadTheBoundIsTheGeometricSeries) {
  const double frequency = std::sqrt(robot::kGravity / robot::StandingHeight(model_));
  const stepping::StepChoice choice =
      MakeRecovery(RecoveryConfig(), ContactConfirmation(), model_, -1).choice();
  const auto ahead = [&](robot::Foot foot, double sign) {
    double most = -1;
    for (const Vector2d& corner : choice.reach().Leg(foot, 1).corners()) {
      most = std::max(most, sign * corner.x());
    }
    return most;
  };
  const double length =
      ahead(robot::Foot::kLeft, 1) + ahead(robot::Foot::kRight, -1) + model_.feet()[0].length;
  double edge = 0;
  const balance::ConvexPolygon sole = balance::SolePolygon(model_.feet()[0], 0);
  for (const Vector2d& corner : sole.corners()) {
    edge = std::max(edge, corner.x());
  }
  const stepping::StepLimits& limits = choice.limits();
  const double decay = std::exp(-frequency * limits.least_swing);
  const double series =
      model_.total_mass() * frequency *
      (edge + length * std::exp(-frequency * limits.unload) * decay / (1 - decay));
  EXPECT_NEAR(ladder_.Bound({1, 0}), series, 0.02 * series);
}

INSTANTIATE_TEST_SUITE_P(Robots, StepLadderTest, testing::Values(robot::TestRobot::kDyros));

}  // namespace
}  // namespace poise
