// What cannot be computed is refused: NaN anywhere, singular postures, dependent tasks, wrong
// sizes.
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

struct Inputs {
  Eigen::MatrixXd mass, contact_jacobian, jacobian;
  Eigen::VectorXd bias, gravity, contact_bias, bias_acceleration;
};

Inputs MakeInputs(const std::shared_ptr<const robot::RobotModel>& model,
                  const std::array<bool, 2>& in_contact) {
  StateSampler sampler(model, 21);
  WholeBody body(model);
  EXPECT_TRUE(body.Update(sampler.Draw(), in_contact));
  Inputs in;
  in.mass = body.data().mass_matrix;
  in.bias = body.data().bias;
  in.gravity = body.data().gravity;
  body.ContactJacobian(in_contact, &in.contact_jacobian);
  in.contact_bias = sampler.Vector(in.contact_jacobian.rows(), 1);
  const StackedTask task = PaperTask(body, in_contact);
  in.jacobian = task.jacobian;
  in.bias_acceleration = task.bias_acceleration;
  return in;
}

bool ContactsExist(ContactDynamics* contact, const Inputs& in) {
  return contact->Compute(in.mass, in.bias, in.gravity, in.contact_jacobian, in.contact_bias);
}

class DegenerateInput : public testing::TestWithParam<std::tuple<bool, bool>> {
 protected:
  std::shared_ptr<const robot::RobotModel> model_ = std::get<0>(GetParam()) ? Biped() : Humanoid();
  std::array<bool, 2> in_contact_ = std::get<1>(GetParam()) ? kDouble : kLeft;
};

TEST_P(DegenerateInput, AnyNonFiniteNumberIsRefused) {
  const Inputs good = MakeInputs(model_, in_contact_);
  ContactDynamics contact(model_->num_joints());
  TaskDynamics task(model_->num_joints(), 12);
  ASSERT_TRUE(ContactsExist(&contact, good));
  for (const double value : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    const auto refused = [&](auto member) {
      for (Eigen::Index i = 0; i < (good.*member).size(); ++i) {
        Inputs bad = good;
        (bad.*member).data()[i] = value;
        EXPECT_FALSE(ContactsExist(&contact, bad)) << i << " " << value;
      }
    };
    refused(&Inputs::bias);
    refused(&Inputs::gravity);
    refused(&Inputs::contact_bias);
    refused(&Inputs::contact_jacobian);
    // A symmetric matrix is broken in both places.
    for (Eigen::Index i = 0; i < good.mass.rows(); ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        Inputs bad = good;
        bad.mass(i, j) = bad.mass(j, i) = value;
        EXPECT_FALSE(ContactsExist(&contact, bad)) << i << " " << j << " " << value;
      }
    }
    ASSERT_TRUE(ContactsExist(&contact, good));  // nothing of the bad inputs lingers
    for (Eigen::Index i = 0; i < good.jacobian.size(); ++i) {
      Inputs bad = good;
      bad.jacobian.data()[i] = value;
      EXPECT_FALSE(task.Compute(contact, bad.jacobian, bad.bias_acceleration)) << i << " " << value;
    }
    for (Eigen::Index i = 0; i < good.bias_acceleration.size(); ++i) {
      Inputs bad = good;
      bad.bias_acceleration(i) = value;
      EXPECT_FALSE(task.Compute(contact, bad.jacobian, bad.bias_acceleration)) << i << " " << value;
    }
    EXPECT_TRUE(task.Compute(contact, good.jacobian, good.bias_acceleration));
  }
}

TEST_P(DegenerateInput, MatricesThatAreNotPositiveDefiniteAreRefused) {
  const Inputs good = MakeInputs(model_, in_contact_);
  ContactDynamics contact(model_->num_joints());
  Inputs bad = good;
  bad.mass *= -1;
  EXPECT_FALSE(ContactsExist(&contact, bad));
  bad.mass.setZero();
  EXPECT_FALSE(ContactsExist(&contact, bad));
  // No body's columns are a rigid transform when they are scaled.
  bad = good;
  bad.contact_jacobian *= 1.001;
  EXPECT_FALSE(ContactsExist(&contact, bad));
  bad = good;
  bad.contact_jacobian.setZero();
  EXPECT_FALSE(ContactsExist(&contact, bad));
  if (in_contact_ == kDouble) {
    bad = good;
    bad.contact_jacobian.bottomRows(6) = bad.contact_jacobian.topRows(6);  // the same foot twice
    EXPECT_FALSE(ContactsExist(&contact, bad));
    // A singular posture: one internal load that no joint feels.
    bad = good;
    const int k = model_->num_joints();
    const Eigen::MatrixXd joints = good.contact_jacobian.rightCols(k),
                          base = good.contact_jacobian.leftCols(6);
    const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(6, 1, 2);
    Eigen::VectorXd load(12);
    load << right, -base.bottomRows(6).transpose().lu().solve(base.topRows(6).transpose() * right);
    load.normalize();
    ASSERT_LT((base.transpose() * load).norm(), 1e-12);
    ASSERT_GT((joints.transpose() * load).norm(), 1e-3);
    bad.contact_jacobian.rightCols(k) -= load * (load.transpose() * joints);
    EXPECT_FALSE(ContactsExist(&contact, bad));
  }
}

TEST_P(DegenerateInput, DependentTasksAreRefused) {
  const Inputs in = MakeInputs(model_, in_contact_);
  const int k = model_->num_joints();
  ContactDynamics contact(k);
  ASSERT_TRUE(ContactsExist(&contact, in));
  TaskDynamics task(k, 12);
  Inputs bad = in;
  bad.jacobian.row(2) = bad.jacobian.row(0) + 0.5 * bad.jacobian.row(1);
  EXPECT_FALSE(task.Compute(contact, bad.jacobian, bad.bias_acceleration));
  bad = in;
  bad.jacobian.row(0).setZero();
  EXPECT_FALSE(task.Compute(contact, bad.jacobian, bad.bias_acceleration));
  // A stance foot cannot be moved.
  bad = in;
  bad.jacobian.topRows(3) = in.contact_jacobian.topRows(3);
  EXPECT_FALSE(task.Compute(contact, bad.jacobian, bad.bias_acceleration));
}

TEST_P(DegenerateInput, WrongSizesAreRefused) {
  const Inputs in = MakeInputs(model_, in_contact_);
  const int k = model_->num_joints();
  ContactDynamics contact(k), smaller(k - 1);
  ASSERT_TRUE(ContactsExist(&contact, in));
  EXPECT_FALSE(ContactsExist(&smaller, in));
  EXPECT_FALSE(contact.Compute(in.mass, in.bias, in.gravity, in.contact_jacobian.topRows(5),
                               in.contact_bias.head(5)));
  EXPECT_FALSE(
      contact.Compute(in.mass, in.bias.head(3), in.gravity, in.contact_jacobian, in.contact_bias));
  ASSERT_TRUE(ContactsExist(&contact, in));
  TaskDynamics task(k, 2);
  EXPECT_FALSE(task.Compute(contact, in.jacobian, in.bias_acceleration));
  EXPECT_FALSE(task.Compute(contact, in.jacobian.topRows(2), in.bias_acceleration));
  EXPECT_FALSE(task.Compute(contact, in.jacobian.topRows(0), in.bias_acceleration.head(0)));
  EXPECT_TRUE(task.Compute(contact, in.jacobian.topRows(2), in.bias_acceleration.head(2)));
}

INSTANTIATE_TEST_SUITE_P(Robots, DegenerateInput,
                         testing::Combine(testing::Bool(), testing::Bool()), [](const auto& info) {
                           return std::string(std::get<0>(info.param) ? "Biped" : "Humanoid") +
                                  (std::get<1>(info.param) ? "Double" : "Single");
                         });

TEST(DegenerateState, NonFiniteStatesAreRefused) {
  const auto model = Biped();
  StateSampler sampler(model, 22);
  const robot::RobotState good = sampler.Draw();
  WholeBody body(model);
  const auto refused = [&](auto&& change) {
    robot::RobotState bad = good;
    change(bad);
    EXPECT_FALSE(body.Update(bad, kDouble));
    EXPECT_FALSE(body.Update(bad, kRight));
    EXPECT_TRUE(body.Update(good, kDouble));
  };
  const double nan = std::nan("");
  refused([&](auto& s) { s.base_orientation.w() = nan; });
  refused([&](auto& s) { s.base_orientation.coeffs().setZero(); });
  refused([&](auto& s) { s.base_angular_velocity.x() = nan; });
  for (int i = 0; i < 12; ++i) {
    refused([&](auto& s) { s.joint_position(i) = nan; });
    refused([&](auto& s) { s.joint_velocity(i) = HUGE_VAL; });
  }
  EXPECT_FALSE(body.Update(good, {false, false}));
}

// Made-up dynamics of the right structure: any number of joints, from one more than two feet need.
TEST(Sizes, AnyNumberOfJoints) {
  StateSampler sampler(Biped(), 23);
  for (const int k : {7, 8, 13, 33, 64, kMaxJoints}) {
    for (const int m : {6, 12}) {
      const int n = k + 6, t = std::min(6, k - (m - 6));
      const Eigen::MatrixXd root =
          Eigen::MatrixXd::NullaryExpr(n, n, [&] { return sampler.Uniform(-1, 1); });
      const Eigen::MatrixXd mass = root * root.transpose() + Eigen::MatrixXd::Identity(n, n);
      Eigen::MatrixXd jc =
          Eigen::MatrixXd::NullaryExpr(m, n, [&] { return sampler.Uniform(-1, 1); });
      for (int row = 0; row < m; row += 6) {
        Eigen::Isometry3d sole(
            Eigen::Quaterniond(Eigen::Vector4d(sampler.Vector(4, 1))).normalized());
        sole.translation() = sampler.Vector(3, 1);
        jc.block(row, 0, 6, 6) = WrenchTransform(Eigen::Isometry3d::Identity(), sole).transpose();
      }
      const Eigen::VectorXd bias = sampler.Vector(n, 5), gravity = sampler.Vector(n, 5),
                            gamma = sampler.Vector(m, 1);
      ContactDynamics contact(k);
      ASSERT_TRUE(contact.Compute(mass, bias, gravity, jc, gamma)) << k << " " << m;
      const Eigen::MatrixXd jacobian =
          Eigen::MatrixXd::NullaryExpr(t, n, [&] { return sampler.Uniform(-1, 1); });
      const Eigen::VectorXd drift = sampler.Vector(t, 1), wanted = sampler.Vector(t, 5);
      TaskDynamics task(k, t);
      ASSERT_TRUE(task.Compute(contact, jacobian, drift)) << k << " " << m;
      Eigen::VectorXd torque(k), wrench(m), acceleration(n);
      task.TaskTorque(wanted, torque);
      contact.ExpectedWrench(torque, wrench);
      contact.Acceleration(torque, acceleration);

      Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(n + m, n + m);
      kkt << mass, jc.transpose(), jc, Eigen::MatrixXd::Zero(m, m);
      Eigen::VectorXd right(n + m);
      right << -bias - gravity, -gamma;
      right.segment(6, k) += torque;
      const Eigen::VectorXd solution = kkt.fullPivLu().solve(right);
      EXPECT_LT(Residual(acceleration, solution.head(n)), 1e-8) << k << " " << m;
      EXPECT_LT(Residual(wrench, solution.tail(m)), 1e-8) << k << " " << m;
      EXPECT_LT(Residual(jacobian * solution.head(n) + drift, wanted), 1e-8) << k << " " << m;
    }
  }
}

TEST(Sizes, ImpossibleOnesThrow) {
  EXPECT_THROW(ContactDynamics(0), std::invalid_argument);
  EXPECT_THROW(ContactDynamics(kMaxJoints + 1), std::invalid_argument);
  EXPECT_THROW(TaskDynamics(12, 0), std::invalid_argument);
  EXPECT_THROW(TaskDynamics(12, 13), std::invalid_argument);
  EXPECT_THROW(BalanceControl(12, 0), std::invalid_argument);
}

}  // namespace
}  // namespace poise::balance
