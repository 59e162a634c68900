#include "components/balance/whole_body.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/balance/balance_test_support.h"

namespace poise::balance {
namespace {

// Components of one process share a WholeBody: what one asks must not depend on what another asked
// before.
TEST(WholeBody, IsAPureFunctionOfItsArguments) {
  const auto model = Humanoid();
  const int k = model->num_joints();
  StateSampler sampler(model, 31);
  const robot::RobotState first = sampler.Draw(), second = sampler.Draw();
  const Eigen::VectorXd torque = sampler.Vector(k, 20);
  const auto wrench = [&](WholeBody& body, const robot::RobotState& state,
                          const std::array<bool, 2>& in_contact) {
    EXPECT_TRUE(body.Update(state, in_contact));
    Eigen::VectorXd w(body.contact().num_contact_rows());
    body.contact().ExpectedWrench(torque, w);
    return w;
  };
  WholeBody fresh(model);
  const Eigen::VectorXd expected = wrench(fresh, first, kDouble);
  WholeBody used(model);
  used.UpdateKinematics(second);
  wrench(used, second, kLeft);
  used.UpdateKinematics(first);
  EXPECT_EQ(used.data().foot_pose[1].matrix(), fresh.data().foot_pose[1].matrix());
  wrench(used, first, kRight);
  EXPECT_EQ(wrench(used, first, kDouble), expected);
  EXPECT_EQ(wrench(used, first, kDouble), expected);
  EXPECT_EQ(used.geometry().in_contact, kDouble);
  // A change of velocity alone is a change.
  robot::RobotState faster = first;
  faster.joint_velocity(2) += 1;
  EXPECT_NE(wrench(used, faster, kDouble), expected);
}

TEST(WholeBody, ContactJacobianMapsVelocityToTheSoles) {
  const auto model = Humanoid();
  StateSampler sampler(model, 32);
  WholeBody body(model);
  const robot::RobotState state = sampler.Draw();
  body.UpdateKinematics(state);
  Eigen::VectorXd velocity(model->num_velocities());
  velocity << state.base_linear_velocity, state.base_angular_velocity, state.joint_velocity;
  for (const auto& in_contact : {kDouble, kRight, kLeft}) {
    // It has the right size, whatever it holds: joints that are no leg's have columns, too.
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Constant(6 * (in_contact[0] + in_contact[1]),
                                                         model->num_velocities(), std::nan(""));
    body.ContactJacobian(in_contact, &jacobian);
    ASSERT_EQ(jacobian.rows(), 6 * (in_contact[0] + in_contact[1]));
    int row = 0;
    for (size_t i = 0; i < 2; ++i) {
      if (!in_contact[i]) continue;
      Vector6d expected;
      const Eigen::Matrix3d to_sole = body.data().foot_pose[i].linear().transpose();
      expected << to_sole * body.data().foot_velocity[i].head<3>(),
          to_sole * body.data().foot_velocity[i].tail<3>();
      EXPECT_LT((jacobian.middleRows(row, 6) * velocity - expected).norm(), 1e-12);
      row += 6;
    }
  }
}

// A stance foot that turns with the robot: the acceleration from the contact dynamics keeps the
// sole's velocity constant, checked by finite differences of the sole's velocity along that
// acceleration.
TEST(WholeBody, AccelerationKeepsTheSolesStill) {
  const auto model = Biped();
  StateSampler sampler(model, 33);
  WholeBody body(model);
  for (int i = 0; i < 50; ++i) {
    robot::RobotState state = sampler.Draw();
    ASSERT_TRUE(body.Update(state, kRight));
    // A velocity that the contact allows.
    Eigen::MatrixXd jacobian;
    body.ContactJacobian(kRight, &jacobian);
    Eigen::VectorXd velocity(18);
    velocity.tail(12) = state.joint_velocity;
    velocity.head(6) =
        -jacobian.leftCols(6).lu().solve(jacobian.rightCols(12) * state.joint_velocity);
    state.base_linear_velocity = velocity.head<3>();
    state.base_angular_velocity = velocity.segment<3>(3);
    ASSERT_TRUE(body.Update(state, kRight));
    Eigen::VectorXd acceleration(18);
    body.contact().Acceleration(sampler.Vector(12, 50), acceleration);
    const double h = 1e-5;
    const auto sole_velocity = [&](double time) -> Vector6d {
      robot::RobotState moved = state;
      moved.base_position += time * state.base_linear_velocity;
      const Eigen::Vector3d turn = time * state.base_angular_velocity;
      if (turn.norm() > 0) {
        moved.base_orientation =
            Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) *
            state.base_orientation;
      }
      moved.joint_position += time * state.joint_velocity;
      moved.base_linear_velocity += time * acceleration.head<3>();
      moved.base_angular_velocity += time * acceleration.segment<3>(3);
      moved.joint_velocity += time * acceleration.tail(12);
      WholeBody other(model);
      other.UpdateKinematics(moved);
      return other.data().foot_velocity[0];
    };
    EXPECT_LT(((sole_velocity(h) - sole_velocity(-h)) / (2 * h)).norm(),
              1e-5 * (1 + acceleration.norm()));
  }
}

TEST(WholeBody, LosesNothingFarFromTheOrigin) {
  const auto model = Biped();
  StateSampler sampler(model, 34);
  WholeBody near(model), far(model);
  const Eigen::VectorXd torque = sampler.Vector(12, 50);
  for (int i = 0; i < 50; ++i) {
    robot::RobotState state = sampler.Draw();
    ASSERT_TRUE(near.Update(state, kDouble));
    state.base_position += Eigen::Vector3d(1e4, -2e4, 0);
    ASSERT_TRUE(far.Update(state, kDouble));
    Eigen::VectorXd here(12), there(12);
    near.contact().ExpectedWrench(torque, here);
    far.contact().ExpectedWrench(torque, there);
    EXPECT_LT(Residual(there, here), 1e-9);
  }
}

// Which joints count as legs decides the route, not the result: more of them than there are, apart
// from one another, carrying others; or all.
TEST(WholeBody, TheLegsChosenDoNotChangeTheDynamics) {
  for (const auto& model : {Biped(), Humanoid()}) {
    const int k = model->num_joints();
    StateSampler sampler(model, 19);
    WholeBody body(model);
    std::vector<int> more(body.contact().legs().begin(), body.contact().legs().end());
    if (k > 12) more.push_back(k - 1);
    for (int i = 0; i < 20; ++i) {
      const robot::RobotState state = sampler.Draw();
      for (const auto& in_contact : {kDouble, kRight, kLeft}) {
        ASSERT_TRUE(body.Update(state, in_contact));
        const robot::RobotData& data = body.data();
        const StackedTask task = PaperTask(body, in_contact);
        const Eigen::Index m = in_contact == kDouble ? 12 : 6, t = task.jacobian.rows();
        const Eigen::VectorXd bias = PaperContact(body, in_contact).gamma.cast<double>();
        const Eigen::VectorXd torque = sampler.Vector(k, 50), wanted = sampler.Vector(t, 5);
        Eigen::VectorXd acceleration(k + 6), other(k + 6), wrench(m), other_wrench(m);
        Eigen::VectorXd command(k), other_command(k), projected = torque, other_projected = torque;
        const auto evaluate = [&](const ContactDynamics& contact, Eigen::VectorXd* q,
                                  Eigen::VectorXd* f, Eigen::VectorXd* gamma,
                                  Eigen::VectorXd* null) {
          contact.Acceleration(torque, *q);
          contact.ExpectedWrench(torque, *f);
          TaskDynamics dynamics(k, static_cast<int>(t));
          ASSERT_TRUE(dynamics.Compute(contact, task.jacobian, task.bias_acceleration));
          dynamics.TaskTorque(wanted, *gamma);
          dynamics.ProjectIntoNullSpace(*null);
        };
        evaluate(body.contact(), &acceleration, &wrench, &command, &projected);
        for (ContactDynamics contact : {ContactDynamics(k), ContactDynamics(k, more, true)}) {
          ASSERT_TRUE(contact.Compute(data.mass_matrix, data.bias, data.gravity,
                                      body.contact().contact_jacobian(), bias));
          other_projected = torque;
          evaluate(contact, &other, &other_wrench, &other_command, &other_projected);
          EXPECT_LT(Residual(other, acceleration), 1e-10);
          EXPECT_LT(Residual(other_wrench, wrench), 1e-10);
          EXPECT_LT(Residual(other_command, command), 1e-10);
          EXPECT_LT(Residual(other_projected, projected), 1e-10);
          EXPECT_LT(Residual(contact.w_pinv(), body.contact().w_pinv()), 1e-10);
        }
      }
    }
  }
}

}  // namespace
}  // namespace poise::balance
