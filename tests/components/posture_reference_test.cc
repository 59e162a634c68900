// Joints that are sent elsewhere, against the minimum-jerk line's closed form and the joint limits.
#include "components/task_controller/posture_reference.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>

#include "operate/answer_t.hpp"
#include "tests/components/control_fixture.h"

namespace poise {
namespace {

using operate::answer_t;

constexpr double kTickPeriod = 0.002;  // s
constexpr int kLeg = 0;

class PostureReferenceTest : public testing::Test {
 protected:
  PostureReferenceTest() : limits_(model_, kTickPeriod) {
    posture_.emplace(limits_, std::array{kLeg}, kTickPeriod);
    posture_->Hold(Eigen::VectorXd::Zero(model_.num_joints()));
  }

  int8_t Move(int joint, double angle, double duration, double time) {
    operate::act_t act{};
    act.kind = operate::act_t::KIND_JOINT;
    act.body = joint;
    act.value = angle;
    act.duration = std::llround(duration / kTickPeriod);
    return posture_->Move(act, time);
  }

  robot::RobotModel model_ = robot::LoadTestRobot(robot::TestRobot::kMantis);
  balance::JointLimits limits_;
  std::optional<PostureReference> posture_;
};

TEST_F(PostureReferenceTest, FromRestItIsTheMinimumJerkLine) {
  const int arm = model_.num_joints() - 1;
  const double angle = 0.5 * limits_.range(arm).upper, duration = 4;
  ASSERT_EQ(Move(arm, angle, duration, 1.0), answer_t::VERDICT_DONE);
  for (double s = 0; s <= 1.25; s += 0.05) {
    posture_->Update(1 + s * duration);
    const double u = std::min(s, 1.0);
    EXPECT_NEAR(posture_->position()[arm],
                angle * (10 * std::pow(u, 3) - 15 * std::pow(u, 4) + 6 * std::pow(u, 5)), 1e-12)
        << s;
    EXPECT_NEAR(posture_->velocity()[arm], angle / duration * 30 * u * u * (1 - u) * (1 - u),
                1e-12);
    for (int j = 0; j < arm; ++j) EXPECT_EQ(posture_->position()[j], 0);
  }
}

TEST_F(PostureReferenceTest, AMoveThatIsTooFastTakesAsLongAsTheLimitsAsk) {
  for (int j = 0; j < model_.num_joints(); ++j) {
    if (j == kLeg) continue;
    const balance::JointRange& range = limits_.range(j);
    ASSERT_EQ(Move(j, range.upper, 0, 0), answer_t::VERDICT_DONE);
    double speed = 0, acceleration = 0, end = 0;
    for (int tick = 0; tick < 30000; ++tick) {
      posture_->Update(tick * kTickPeriod);
      speed = std::max(speed, std::abs(posture_->velocity()[j]));
      acceleration = std::max(acceleration, std::abs(posture_->acceleration()[j]));
      if (posture_->position()[j] < range.upper - 1e-9) end = tick * kTickPeriod;
    }
    // Its greatest speed and acceleration are looked for at 15 points: 1 % is missed at most.
    EXPECT_LE(speed, 1.01 * range.velocity) << j;
    EXPECT_LE(acceleration, 1.01 * range.acceleration) << j;
    // The minimum-jerk line's own: 15/8 d/T and 10/√3 d/T².
    const double least =
        std::max(1.875 * range.upper / range.velocity,
                 std::sqrt(10 / std::sqrt(3.0) * range.upper / range.acceleration));
    EXPECT_LE(end, 1.11 * least + 2 * kTickPeriod) << j;
  }
}

TEST_F(PostureReferenceTest, TargetsAtAnyRateMakeNoStepOfPositionVelocityOrAcceleration) {
  const int arm = model_.num_joints() - 1;
  const balance::JointRange& range = limits_.range(arm);
  double last_velocity = 0, last_position = 0, time = 0;
  for (int tick = 0; tick < 5000; ++tick, time = tick * kTickPeriod) {
    if (tick % 7 == 3) {
      const double angle =
          0.6 * range.upper * std::sin(2 * time) + 0.1 * range.upper * std::sin(31 * time);
      ASSERT_EQ(Move(arm, angle, 0.1, time), answer_t::VERDICT_DONE);
    }
    posture_->Update(time);
    const double velocity = posture_->velocity()[arm], position = posture_->position()[arm];
    EXPECT_LE(std::abs(position - last_position), 1.1 * range.velocity * kTickPeriod);
    EXPECT_LE(std::abs(velocity - last_velocity), 1.1 * range.acceleration * kTickPeriod);
    last_velocity = velocity;
    last_position = position;
  }
}

TEST_F(PostureReferenceTest, LegsAndAnglesThatAreNoneAreRefused) {
  const int arm = model_.num_joints() - 1;
  EXPECT_EQ(Move(kLeg, 0, 1, 0), answer_t::VERDICT_NOT_ABLE);
  EXPECT_EQ(Move(arm, limits_.range(arm).upper + 0.01, 1, 0), answer_t::VERDICT_RANGE);
  EXPECT_EQ(Move(arm, std::nan(""), 1, 0), answer_t::VERDICT_RANGE);
  EXPECT_EQ(Move(-1, 0, 1, 0), answer_t::VERDICT_UNKNOWN);
  EXPECT_EQ(Move(model_.num_joints(), 0, 1, 0), answer_t::VERDICT_UNKNOWN);
  posture_->Update(1);
  EXPECT_TRUE(posture_->position().isZero(0));
}

}  // namespace
}  // namespace poise
