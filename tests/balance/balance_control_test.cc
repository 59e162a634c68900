// Section 5: when balancing acts, when it must not, and what it reports.
#include "components/balance/balance_control.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

/// A robot that stands still under gravity compensation, so that its load is its weight.
class BalanceControlTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    model_ = Biped();
    body_ = std::make_unique<WholeBody>(model_);
    StateSampler sampler(model_, 11);
    // Tilted sole frames make F_z of O differ from the vertical force; the CoP must not care. Soles
    // that lean by more carry no robot: it would pull at them.
    double upright = 0;
    while (upright < 0.9) {
      state_ = sampler.Draw();
      state_.base_linear_velocity.setZero();
      state_.base_angular_velocity.setZero();
      state_.joint_velocity.setZero();
      ASSERT_TRUE(body_->Update(state_, GetParam() ? kDouble : kLeft));
      const ContactGeometry geometry = body_->geometry();
      upright = std::min(geometry.sole[0].linear()(2, 2), geometry.sole[1].linear()(2, 2));
    }
    torque_.resize(model_->num_joints());
    GravityCompensation(body_->contact(), torque_);
    const StackedTask com_height = ComHeight(*body_);
    ASSERT_TRUE(
        height_.Compute(body_->contact(), com_height.jacobian, com_height.bias_acceleration));
    geometry_ = body_->geometry();
    ContactLimits wide;
    wide.half_length = wide.half_width = 100;
    Eigen::VectorXd torque = torque_;
    ASSERT_EQ(Compute(wide, true, &torque), BalanceStatus::kOk);
    EXPECT_FALSE(result_.active_x || result_.active_y);
    EXPECT_EQ(torque, torque_);
    natural_ = result_.cop_task;
    ASSERT_GT(natural_.cwiseAbs().minCoeff(), 1e-4);
  }

  BalanceStatus Compute(const ContactLimits& limits, bool enabled, Eigen::VectorXd* torque) {
    return balance_.Compute(body_->contact(), height_, geometry_, limits, enabled, *torque,
                            &result_);
  }

  std::shared_ptr<const robot::RobotModel> model_;
  std::unique_ptr<WholeBody> body_;
  robot::RobotState state_;
  Eigen::VectorXd torque_;
  TaskDynamics height_{12, 1};
  BalanceControl balance_{12, 1};
  ContactGeometry geometry_;
  BalanceResult result_;
  Eigen::Vector2d natural_;
};

TEST_P(BalanceControlTest, TheLineOfGravityMeetsTheCentreOfPressure) {
  // Statics: the weight acts along the vertical through the COM, which meets O's plane at the CoP.
  const Eigen::Vector3d com = result_.frame_o.inverse(Eigen::Isometry) * body_->data().com;
  const Eigen::Vector3d down = result_.frame_o.linear().transpose() * -Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d at = com - down * (com.z() / down.z());
  EXPECT_LT((at.head<2>() - natural_).norm(), 1e-9);
}

TEST_P(BalanceControlTest, OnlyTheCoordinateOutsideMoves) {
  for (const int axis : {0, 1}) {
    ContactLimits limits;
    limits.half_length = axis == 0 ? 0.8 * std::abs(natural_.x()) : 100;
    limits.half_width = axis == 1 ? 0.8 * std::abs(natural_.y()) : 100;
    Eigen::VectorXd torque = torque_;
    ASSERT_EQ(Compute(limits, true, &torque), BalanceStatus::kOk);
    EXPECT_EQ(result_.active_x, axis == 0);
    EXPECT_EQ(result_.active_y, axis == 1);
    EXPECT_NEAR(result_.cop(axis), 0.8 * natural_(axis), 1e-12);
    EXPECT_NEAR(result_.cop(1 - axis), natural_(1 - axis), 1e-12);
    EXPECT_EQ(result_.cop_task, natural_);
    EXPECT_GT((torque - torque_).norm(), 1e-3);
    // Twice is once: the CoP is already on its bound.
    Eigen::VectorXd again = torque;
    Compute(limits, true, &again);
    EXPECT_LT((again - torque).norm(), 1e-9);
  }
}

TEST_P(BalanceControlTest, DisabledOnlyEvaluates) {
  ContactLimits limits;
  limits.half_length = limits.half_width = 1e-6;
  Eigen::VectorXd torque = torque_;
  EXPECT_EQ(Compute(limits, false, &torque), BalanceStatus::kOk);
  EXPECT_TRUE(result_.active_x && result_.active_y);
  EXPECT_EQ(torque, torque_);
  EXPECT_EQ(result_.cop, natural_);
}

TEST_P(BalanceControlTest, PullingOnTheGroundHasNoCentreOfPressure) {
  // A COM that shall fall faster than gravity pulls it.
  Eigen::VectorXd command(12), f(1);
  f << -10 * robot::kGravity;
  height_.TaskTorque(f, command);
  Eigen::VectorXd torque = command;
  EXPECT_EQ(Compute(ContactLimits{}, true, &torque), BalanceStatus::kUnloaded);
  EXPECT_EQ(torque, command);
  EXPECT_GT(result_.resultant_task(2), 0);
}

TEST_P(BalanceControlTest, SingularInputsLeaveTheTorqueAlone) {
  ContactLimits limits;
  limits.half_length = limits.half_width = 1e-6;
  Eigen::VectorXd torque = torque_;
  const ContactGeometry good = geometry_;
  geometry_.in_contact = GetParam() ? kRight : kDouble;  // not the contacts of the dynamics
  EXPECT_EQ(Compute(limits, true, &torque), BalanceStatus::kSingular);
  geometry_ = good;
  geometry_.sole[1].translation().x() = std::nan("");
  EXPECT_EQ(Compute(limits, true, &torque), BalanceStatus::kSingular);
  geometry_ = good;
  if (GetParam()) {
    geometry_.sole[1] = geometry_.sole[0];
    EXPECT_EQ(Compute(limits, true, &torque), BalanceStatus::kSingular);
    geometry_ = good;
  }
  EXPECT_EQ(torque, torque_);
  torque(3) = std::nan("");
  EXPECT_EQ(Compute(limits, true, &torque), BalanceStatus::kSingular);
  for (int i = 0; i < 12; ++i) EXPECT_TRUE(i == 3 || torque(i) == torque_(i));
  torque = torque_;
  limits.half_length = std::nan("");
  Compute(limits, true, &torque);
  EXPECT_TRUE(torque.allFinite());
}

INSTANTIATE_TEST_SUITE_P(Supports, BalanceControlTest, testing::Bool(),
                         [](const auto& info) { return info.param ? "Double" : "Single"; });

}  // namespace
}  // namespace poise::balance
