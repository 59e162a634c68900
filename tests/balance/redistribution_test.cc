// The whole pipeline of sections 3 to 6 against routes that share no formula with it.
#include "components/balance/redistribution.h"

#include <gtest/gtest.h>

#include "components/balance/distribution_ratio.h"
#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

/// Feet's wrenches by η from a resultant, for soles `foot` in frame O.
Eigen::VectorXd Split(const Vector6d& resultant, const std::array<Eigen::Isometry3d, 2>& foot,
                      double eta) {
  const auto share = DistributeResultant(resultant, foot, eta);
  Eigen::VectorXd wrench(12);
  wrench << share[0], share[1];
  return wrench;
}

std::array<Eigen::Isometry3d, 2> SolesIn(const Eigen::Isometry3d& frame,
                                         const ContactGeometry& geometry) {
  const Eigen::Isometry3d inverse = frame.inverse(Eigen::Isometry);
  return {inverse * geometry.sole[0], inverse * geometry.sole[1]};
}

// With as many task and contact rows as velocities the tasks alone fix q̈; Newton's law then gives
// the resultant and the torque for a given η.
TEST(IndependentRoute, DoubleSupport) {
  const auto model = Biped();
  StateSampler sampler(model, 3);
  WholeBody body(model);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(body.Update(sampler.Draw(), kDouble));
    const StackedTask stacked = PaperTask(body, kDouble);
    const Eigen::VectorXd wanted = sampler.Vector(6, 5);
    const double eta = sampler.Uniform(0, 1);
    const ContactGeometry geometry = body.geometry();

    TaskDynamics task(12, 6), height(12, 1);
    ASSERT_TRUE(task.Compute(body.contact(), stacked.jacobian, stacked.bias_acceleration));
    const StackedTask com_height = ComHeight(body);
    ASSERT_TRUE(height.Compute(body.contact(), com_height.jacobian, com_height.bias_acceleration));
    Eigen::VectorXd torque(12), wrench(12), shift(12);
    task.TaskTorque(wanted, torque);
    BalanceControl balance(12, 1);
    BalanceResult result;
    balance.Compute(body.contact(), height, geometry, ContactLimits{}, false, torque, &result);
    body.contact().ExpectedWrench(torque, wrench);
    const auto foot = SolesIn(result.frame_o, geometry);
    const Eigen::VectorXd change = Split(result.resultant, foot, eta) - wrench;
    EXPECT_LT(RedistributionTorque(body.contact().contact_jacobian(), change, shift), 1e-8);
    torque += shift;

    const PaperContact paper(body, kDouble);
    MatrixL rows(18, 18);
    rows << stacked.jacobian.cast<Real>(), paper.jc;
    VectorL right(18);
    right << (wanted - stacked.bias_acceleration).cast<Real>(), -paper.gamma;
    const VectorL acceleration = rows.partialPivLu().solve(right);
    const VectorL force = paper.a * acceleration + paper.b + paper.g;
    // The base's linear momentum balance is about the base's origin in world axes.
    Eigen::Isometry3d base = Eigen::Isometry3d::Identity();
    base.translation() = body.data().base_position;
    const Vector6d resultant =
        WrenchTransform(result.frame_o, base) * -force.head(6).cast<double>();
    const VectorL feet = Split(resultant, foot, eta).cast<Real>();
    worst = std::max(worst, Residual(torque, (force + paper.jc.transpose() * feet).tail(12)));
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(IndependentRoute, SingleSupport) {
  const auto model = Biped();
  StateSampler sampler(model, 4);
  WholeBody body(model);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto& in_contact = i % 2 == 0 ? kRight : kLeft;
    ASSERT_TRUE(body.Update(sampler.Draw(), in_contact));
    const StackedTask stacked = PaperTask(body, in_contact);
    const Eigen::VectorXd wanted = sampler.Vector(12, 5);
    TaskDynamics task(12, 12);
    ASSERT_TRUE(task.Compute(body.contact(), stacked.jacobian, stacked.bias_acceleration));
    Eigen::VectorXd torque(12);
    task.TaskTorque(wanted, torque);

    const PaperContact paper(body, in_contact);
    MatrixL rows(18, 18);
    rows << stacked.jacobian.cast<Real>(), paper.jc;
    VectorL right(18);
    right << (wanted - stacked.bias_acceleration).cast<Real>(), -paper.gamma;
    const VectorL acceleration = rows.partialPivLu().solve(right);
    const VectorL force = paper.a * acceleration + paper.b + paper.g;
    const VectorL foot = paper.jc.leftCols(6).transpose().partialPivLu().solve(-force.head(6));
    worst = std::max(worst, Residual(torque, (force + paper.jc.transpose() * foot).tail(12)));
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(GravityCompensation, HoldsARobotAtRest) {
  for (const auto& model : {Biped(), Humanoid()}) {
    StateSampler sampler(model, 5);
    WholeBody body(model);
    const int k = model->num_joints();
    for (int i = 0; i < 300; ++i) {
      robot::RobotState state = sampler.Draw();
      state.base_linear_velocity.setZero();
      state.base_angular_velocity.setZero();
      state.joint_velocity.setZero();
      const auto& in_contact = i % 3 == 0 ? kDouble : i % 3 == 1 ? kRight : kLeft;
      ASSERT_TRUE(body.Update(state, in_contact));
      Eigen::VectorXd torque(k);
      GravityCompensation(body.contact(), torque);
      const PaperContact paper(body, in_contact);
      VectorL acceleration, wrench;
      paper.Solve(torque.cast<Real>(), &acceleration, &wrench);
      EXPECT_LT(acceleration.cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_LT(Residual(torque, paper.w_pinv * paper.s * paper.a_inverse * paper.nc_t * paper.g),
                1e-9);
      // Statics: the feet carry the weight.
      Eigen::Vector3d carried = Eigen::Vector3d::Zero();
      int row = 0;
      for (int foot = 0; foot < 2; ++foot) {
        if (!in_contact[foot]) continue;
        carried += body.data().foot_pose[foot].linear() * wrench.segment(row, 3).cast<double>();
        row += 6;
      }
      EXPECT_LT((carried - Eigen::Vector3d(0, 0, -model->total_mass() * robot::kGravity)).norm(),
                1e-8);
    }
  }
}

TEST(RedistributionTorque, ReportsAResultant) {
  const auto model = Biped();
  StateSampler sampler(model, 6);
  WholeBody body(model);
  ASSERT_TRUE(body.Update(sampler.Draw(), kDouble));
  Eigen::VectorXd torque(12);
  const Eigen::VectorXd change = Eigen::VectorXd::Unit(12, 2);  // 1 N on one foot alone
  EXPECT_GE(RedistributionTorque(body.contact().contact_jacobian(), change, torque), 1 - 1e-12);
  EXPECT_TRUE(
      std::isnan(RedistributionTorque(body.contact().contact_jacobian(), change.head(6), torque)));
}

}  // namespace
}  // namespace poise::balance
