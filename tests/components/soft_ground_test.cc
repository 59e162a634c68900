// The COM's gains on soft ground, against a leg's kinetic energy and a foot on a spring.
#include "components/task_controller/soft_ground.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "components/robot/posture.h"
#include "tests/components/control_fixture.h"

namespace poise {
namespace {

constexpr double kPeriod = 0.002;                  // s
constexpr balance::TaskGains kGains{100, 14};      // ω_c = 10 rad/s, ζ = 0.7
constexpr double kTouchHeight = 0.1, kTouch = 10;  // m, N

class SoftGroundTest : public testing::Test {
 protected:
  /// The left foot comes down, and carries more and more on a spring of `stiffness`, N/m.
  balance::TaskGains AfterLanding(double stiffness, double load) {
    robot::FootArray<SoftGround::FootState> feet;
    feet[robot::Foot::kRight] = {true, 0, weight_};
    feet[robot::Foot::kLeft] = {false, kTouchHeight, 0};
    ground_.Update(feet);
    for (int tick = 0; tick < 1000; ++tick) {
      const double now = std::min(1.0, tick / 500.0) * load;
      feet[robot::Foot::kLeft] = {true, kTouchHeight - now / stiffness, kTouch + now};
      ground_.Update(feet);
    }
    return ground_.Limited(kGains);
  }

  robot::RobotModel model_ = robot::LoadTestRobot(robot::TestRobot::kDyros);
  SoftGround ground_{model_, kPeriod};
  double weight_ = model_.total_mass() * robot::kGravity;
  double omega_ = std::sqrt(robot::kGravity / robot::StandingHeight(model_));
};

// A leg of six joints moves its sole by q̇ = J⁻¹ v: ½ m v² is ½ q̇ᵀ M q̇.
TEST_F(SoftGroundTest, ALegWeighsWhatItsKineticEnergySays) {
  robot::RobotState state(model_.num_joints());
  state.joint_position = model_.stance().joint_position;
  const robot::RobotData data = robot::Evaluate(model_, state);
  for (const robot::Foot foot : robot::kFeet) {
    const auto joints = model_.supporting_joints(model_.feet()[foot].body);
    ASSERT_EQ(joints.size(), 6u);
    Eigen::Matrix<double, 6, 6> jacobian;
    for (int i = 0; i < 6; ++i) jacobian.col(i) = data.foot_jacobian[foot].col(6 + joints[i]);
    const Eigen::Matrix<double, 6, 1> upward = Eigen::Matrix<double, 6, 1>::Unit(2);
    const Eigen::Matrix<double, 6, 1> speed = jacobian.fullPivLu().solve(upward);
    double energy = 0;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        energy += 0.5 * speed[i] * data.mass_matrix(6 + joints[i], 6 + joints[j]) * speed[j];
      }
    }
    EXPECT_NEAR(SoftGround::LegInertia(model_, foot) / (2 * energy), 1, 1e-9);
  }
}

TEST_F(SoftGroundTest, HalfTheFrequencyOfTheFootOnItsSpring) {
  // A COM at 0.8 of kGains' frequency, so that the rule and not the least one decides.
  const double stiffness = std::pow(2 * 8, 2) * SoftGround::LegInertia(model_, robot::Foot::kLeft);
  const balance::TaskGains gains = AfterLanding(stiffness, 0.5 * weight_);
  EXPECT_NEAR(std::sqrt(gains.kp), 8, 0.01);
  EXPECT_NEAR(gains.kd / (2 * std::sqrt(gains.kp)), 0.7, 1e-12);  // the damping ratio stays
}

TEST_F(SoftGroundTest, NeverSlowerThanTheFallAllows) {
  EXPECT_NEAR(std::sqrt(AfterLanding(200, 0.5 * weight_).kp), 1.4 * omega_, 1e-9);
}

TEST_F(SoftGroundTest, HardGroundChangesNoBit) {
  const balance::TaskGains gains = AfterLanding(1e6, 0.5 * weight_);
  EXPECT_EQ(gains.kp, kGains.kp);
  EXPECT_EQ(gains.kd, kGains.kd);
}

TEST_F(SoftGroundTest, WithoutLoadNothingIsSaidOfTheGround) {
  EXPECT_EQ(AfterLanding(500, 0.04 * weight_).kp, kGains.kp);
}

TEST_F(SoftGroundTest, AFootThatLeavesTheGroundForgets) {
  EXPECT_LT(AfterLanding(500, 0.5 * weight_).kp, kGains.kp);
  ground_.Update({SoftGround::FootState{true, 0, weight_}, SoftGround::FootState{false, 0.1, 0}});
  EXPECT_EQ(ground_.Limited(kGains).kp, kGains.kp);
}

// Nobody knows from where feet sank that have stood all the time.
TEST_F(SoftGroundTest, FeetThatStandFromTheStartAreTakenAsHard) {
  robot::FootArray<SoftGround::FootState> feet;
  for (int tick = 0; tick < 500; ++tick) {
    for (SoftGround::FootState& foot : feet) foot = {true, -1e-4 * tick, 0.001 * tick * weight_};
    ground_.Update(feet);
  }
  EXPECT_EQ(ground_.Limited(kGains).kp, kGains.kp);
}

}  // namespace
}  // namespace poise
