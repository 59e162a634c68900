// Feedback into the distribution: internal whatever the sensors say, and gone without two feet.
#include "components/redistributor/internal_feedback.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "components/balance/contact_conditions.h"
#include "components/balance/distribution_ratio.h"
#include "components/framework/configuration/configuration.h"
#include "components/messages/conversions.h"
#include "components/redistributor/redistributor.h"
#include "tests/components/control_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using balance::Vector6d;
using Eigen::Vector3d;

std::array<Eigen::Isometry3d, 2> DrawnSoles(std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::array<Eigen::Isometry3d, 2> foot;
  for (size_t i = 0; i < 2; ++i) {
    foot[i] = Eigen::Isometry3d::Identity();
    foot[i].translation() = Vector3d(0.05 * uniform(*random), i == 0 ? -0.1 : 0.1, 0);
    foot[i].linear() =
        Eigen::AngleAxisd(0.3 * uniform(*random), Vector3d::UnitX()).toRotationMatrix() *
        Eigen::AngleAxisd(0.3 * uniform(*random), Vector3d::UnitZ()).toRotationMatrix();
  }
  return foot;
}

Vector6d Drawn(std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Vector6d wrench;
  for (int i = 0; i < 6; ++i) wrench[i] = (i < 3 ? 100 : 10) * uniform(*random);
  wrench[2] -= 250;
  return wrench;
}

TEST(DistributionError, AnsweredWholeSharesTheMeasuredResultantAndLeavesItAlone) {
  std::mt19937 random(TestSeed(1));
  for (int trial = 0; trial < 200; ++trial) {
    const auto foot = DrawnSoles(&random);
    const std::array<Vector6d, 2> measured{Drawn(&random), Drawn(&random)};
    const double eta = 0.01 * (trial % 100);
    const auto change = WrenchChange(DistributionError(measured, foot, eta), foot);
    // Force and moment about a point of the ground, summed in the axes of O.
    const Vector3d point(0.3, -0.2, 0.1);
    Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
    Vector3d change_force = Vector3d::Zero(), change_moment = Vector3d::Zero();
    for (size_t i = 0; i < 2; ++i) {
      const auto add = [&](const Vector6d& wrench, Vector3d* f, Vector3d* m) {
        const Vector3d in_o = foot[i].linear() * wrench.head<3>();
        *f += in_o;
        *m += foot[i].linear() * wrench.tail<3>() + (foot[i].translation() - point).cross(in_o);
      };
      add(measured[i], &force, &moment);
      add(change.segment<6>(static_cast<Eigen::Index>(6 * i)), &change_force, &change_moment);
    }
    EXPECT_LT(change_force.norm() + change_moment.norm(), 1e-11);
    // (61): the right foot's force is eta of all.
    const Vector6d right = measured[0] + change.head<6>();
    EXPECT_LT((foot[0].linear() * right.head<3>() - eta * force).norm(), 1e-11);
  }
}

// A resultant other than computed is no business of the distribution.
TEST(DistributionError, IsZeroForAnyResultantSharedAsCommanded) {
  std::mt19937 random(TestSeed(2));
  for (int trial = 0; trial < 100; ++trial) {
    const auto foot = DrawnSoles(&random);
    const double eta = 0.3;
    const auto measured = balance::DistributeResultant(Drawn(&random), foot, eta);
    EXPECT_LT(DistributionError(measured, foot, eta).norm(), 1e-11);
  }
}

InternalFeedback Feedback(double integral) {
  WrenchFeedback config;
  config.set_enabled(true);
  config.set_integral(integral);
  return {config, {.force = 100, .moment = 30, .edge = 0}};
}

TEST(InternalFeedback, IntegratesTimeAndNotCalls) {
  const InternalWrench error = InternalWrench::Constant(1);
  InternalFeedback often = Feedback(10), seldom = Feedback(10);
  for (int i = 0; i < 50; ++i) often.Update(error, 0.002, 1);
  for (int i = 0; i < 10; ++i) seldom.Update(error, 0.01, 1);
  EXPECT_NEAR(often.Hold(1)[0], 10 * 0.1, 1e-12);
  EXPECT_LT((often.Hold(1) - seldom.Hold(1)).norm(), 1e-12);
}

TEST(InternalFeedback, StaysWithinItsLimitsAndTurnsBackAtOnce) {
  InternalFeedback feedback = Feedback(100);
  InternalWrench error;
  error << 300, 0, 400, 0, 50, 0;
  InternalWrench answer;
  for (int i = 0; i < 1000; ++i) answer = feedback.Update(error, 0.002, 1);
  EXPECT_NEAR(answer.head<3>().norm(), 100, 1e-9);
  EXPECT_NEAR(answer.tail<3>().norm(), 30, 1e-9);
  feedback.Update(-error, 0.002, 1);
  EXPECT_LT(feedback.Hold(1).head<3>().norm(), 100 - 0.9 * 0.2 * 500 + 1e-9);
  EXPECT_EQ(feedback.Hold(0).norm(), 0);
}

TEST(InternalFeedback, SensesNothingFromWhatIsNotFinite) {
  InternalFeedback feedback = Feedback(100);
  feedback.Update(InternalWrench::Constant(1), 0.002, 1);
  const InternalWrench before = feedback.Hold(1);
  EXPECT_EQ(feedback.Update(InternalWrench::Constant(NAN), 0.002, 1), before);
  EXPECT_EQ(feedback.Hold(1), before);
}

// The redistributor on a standing robot whose feet read what the equations of motion give for the
// tick before, and an internal wrench that nobody computed: friction's.
class ClosedLoop : public testing::Test {
 protected:
  ClosedLoop() : random_(TestSeed(3)), now_(Disturbed(StandingState(model_), 0.03, 0, &random_)) {
    state_ = StateMessage(model_, now_);
    MessageTraits<support_plan_t>::Resize(plan_, std::array{2});
    MessageTraits<balance_torque_t>::Resize(balance_, std::array{model_.num_joints(), 2});
    plan_.in_contact = {1, 1};
    plan_.transition_foot = -1;
    const Dynamics dynamics(model_, now_, {true, true});
    // Any torque that keeps the feet pressed.
    const Eigen::MatrixXd& jacobian = dynamics.contact_jacobian;
    const Eigen::VectorXd hold = jacobian.rightCols(model_.num_joints()).transpose() *
                                 jacobian.leftCols<6>().transpose().colPivHouseholderQr().solve(
                                     -dynamics.data.gravity.head<6>());
    for (int j = 0; j < model_.num_joints(); ++j) {
      balance_.torque[static_cast<size_t>(j)] = dynamics.data.gravity[6 + j] + hold[j];
    }
    balance::FrameO({dynamics.data.foot_pose[0], dynamics.data.foot_pose[1]}, {true, true},
                    &frame_o_);
    SetPose(frame_o_, &balance_.frame_o);
    Eigen::VectorXd acceleration;
    dynamics.Forward(ToEigen(balance_.torque), &acceleration, &wrench_);
    Vector6d resultant = Vector6d::Zero();
    for (size_t i = 0; i < 2; ++i) {
      sole_[i] = frame_o_.inverse() * dynamics.data.foot_pose[i];
      const Vector6d wrench = wrench_.segment<6>(static_cast<Eigen::Index>(6 * i));
      SetWrench(wrench, &balance_.foot_wrench[i]);
      resultant += balance::WrenchTransform(frame_o_, dynamics.data.foot_pose[i]) * wrench;
    }
    SetWrench(resultant, &balance_.resultant);
    disturbance_ << 20, -10, 30, 2, 3, -1;
  }
  void Bind(Harness<Redistributor>* harness) {
    harness->Bind("robot_state", &state_);
    harness->Bind("support_plan", &plan_);
    harness->Bind("balance_torque", &balance_);
  }
  void Read(const joint_command_t& command) {
    const Dynamics dynamics(model_, now_, {true, true});
    dynamics.Forward(ToEigen(command.torque), &acceleration_, &wrench_);
    const auto strange = WrenchChange(disturbance_, sole_);
    for (size_t i = 0; i < 2; ++i) {
      const auto row = static_cast<Eigen::Index>(6 * i);
      SetWrench(wrench_.segment<6>(row) + strange.segment<6>(row), &state_.foot_wrench[i]);
    }
  }
  // N, measured less computed force of both feet.
  double ForceError(const joint_command_t& command) const {
    double squared = 0;
    for (size_t i = 0; i < 2; ++i) {
      squared +=
          (GetVector3(state_.foot_wrench[i].force) - GetVector3(command.foot_wrench[i].force))
              .squaredNorm();
    }
    return std::sqrt(squared);
  }

  robot::RobotModel model_ = robot::LoadTestRobot(robot::TestRobot::kDyros);
  std::mt19937 random_;
  robot::RobotState now_;
  robot_state_t state_;
  support_plan_t plan_{};
  balance_torque_t balance_{};
  Eigen::Isometry3d frame_o_;
  std::array<Eigen::Isometry3d, 2> sole_;
  Eigen::VectorXd wrench_, acceleration_;
  InternalWrench disturbance_;
};

TEST_F(ClosedLoop, FrictionsInternalWrenchIsTakenOutAndTheRobotIsNotMoved) {
  ControlContext context(robot::TestRobot::kDyros);
  Harness<Redistributor> harness(&context,
                                 RedistributorText("feedback { enabled: true integral: 25 }"));
  Bind(&harness);
  harness.Run(TickAt(0));
  const joint_command_t& out = harness.output<joint_command_t>();
  ASSERT_EQ(ToEigen(out.feedback_torque).norm(), 0);
  Read(out);
  const Eigen::VectorXd first = acceleration_;
  const double error = ForceError(out);
  EXPECT_GT(error, 30);
  for (int tick = 1; tick < 200; ++tick) {
    harness.Run(TickAt(tick));
    Read(out);
    EXPECT_LT((acceleration_ - first).norm(), 1e-8);
    EXPECT_LT(ForceError(out), error * 1.000001) << "tick " << tick;
  }
  EXPECT_LT(ForceError(out), 0.01 * error);
  EXPECT_LT(
      (ToEigen(out.torque) - ToEigen(balance_.torque) - ToEigen(out.redistribution_torque)).norm(),
      1e-12);
  EXPECT_GT(ToEigen(out.feedback_torque).norm(), 1);
}

TEST_F(ClosedLoop, OffByDefault) {
  ControlContext context(robot::TestRobot::kDyros);
  Harness<Redistributor> harness(&context, RedistributorText());
  Bind(&harness);
  const joint_command_t& out = harness.output<joint_command_t>();
  for (int tick = 0; tick < 10; ++tick) {
    harness.Run(TickAt(tick));
    Read(out);
  }
  EXPECT_GT(ForceError(out), 30);
  EXPECT_EQ(ToEigen(out.feedback_torque).norm(), 0);
}

TEST_F(ClosedLoop, AnUnloadedFootAndSingleSupportKnowNone) {
  ControlContext context(robot::TestRobot::kDyros);
  Harness<Redistributor> harness(&context,
                                 RedistributorText("feedback { enabled: true integral: 25 }"));
  Bind(&harness);
  const joint_command_t& out = harness.output<joint_command_t>();
  double largest_step = 0;
  Eigen::VectorXd before;
  for (int tick = 0; tick < 300; ++tick) {
    if (tick >= 100) {
      plan_.transition = support_plan_t::TRANSITION_UNLOADING;
      plan_.transition_foot = 1;
      plan_.transition_progress = std::min(1.0, (tick - 100) / 150.0);
    }
    harness.Run(TickAt(tick));
    if (tick > 60)
      largest_step = std::max(largest_step, (ToEigen(out.feedback_torque) - before).norm());
    before = ToEigen(out.feedback_torque);
    if (tick == 90) {
      EXPECT_GT(before.norm(), 1);
    }
    Read(out);
  }
  EXPECT_EQ(before.norm(), 0);
  EXPECT_LT(largest_step, 1);  // N·m in a tick
  plan_.transition = support_plan_t::TRANSITION_NONE;
  plan_.in_contact = {1, 0};
  harness.Run(TickAt(300));
  EXPECT_EQ(ToEigen(out.feedback_torque).norm(), 0);
  // Back on both feet the answer begins from nothing, without a reading of two feet to go by.
  plan_.in_contact = {1, 1};
  harness.Run(TickAt(301));
  EXPECT_EQ(ToEigen(out.feedback_torque).norm(), 0);
}

TEST_F(ClosedLoop, ASoleAboutToTipLetsItGoAndItLearnsAgainAfterThePause) {
  ControlContext context(robot::TestRobot::kDyros);
  Harness<Redistributor> harness(&context,
                                 RedistributorText("feedback { enabled: true integral: 25 }"));
  Bind(&harness);
  const joint_command_t& out = harness.output<joint_command_t>();
  int tick = 0;
  const auto run = [&] {
    const double last = ToEigen(out.feedback_torque).norm();
    harness.Run(TickAt(tick++));
    Read(out);
    return last;
  };
  while (tick < 100) run();
  const double before = ToEigen(out.feedback_torque).norm();
  ASSERT_GT(before, 1);
  // Beyond the toes of soles of 0.30 m.
  const double moment = balance_.resultant.moment[1];
  balance_.resultant.moment[1] = -0.17 * balance_.resultant.force[2];
  for (int i = 0; i < 50; ++i) {
    const double last = run();
    EXPECT_LT(ToEigen(out.feedback_torque).norm(), last);
    EXPECT_GT(ToEigen(out.feedback_torque).norm(), 0.97 * last);  // no step
  }
  const double released = ToEigen(out.feedback_torque).norm();
  EXPECT_NEAR(released, before * std::exp(-1), 0.02 * before);
  balance_.resultant.moment[1] = moment;
  for (int i = 0; i < 99; ++i) run();
  EXPECT_NEAR(ToEigen(out.feedback_torque).norm(), released, 1e-12);
  for (int i = 0; i < 20; ++i) run();
  EXPECT_GT(ToEigen(out.feedback_torque).norm(), 1.05 * released);
}

TEST(InternalFeedback, ALightFootIsGivenLess) {
  const InternalFeedback feedback = Feedback(10);
  EXPECT_EQ(feedback.LoadShare(0.5), 1);
  EXPECT_EQ(feedback.LoadShare(0.1), 1);
  EXPECT_NEAR(feedback.LoadShare(0.9), 1, 1e-12);
  EXPECT_NEAR(feedback.LoadShare(0.05), 0.5, 1e-12);
  EXPECT_NEAR(feedback.LoadShare(0.95), 0.5, 1e-12);
  EXPECT_EQ(feedback.LoadShare(0), 0);
  EXPECT_EQ(feedback.LoadShare(1), 0);
}

TEST_F(ClosedLoop, SkippedTicksHoldWhatIsKnown) {
  ControlContext context(robot::TestRobot::kDyros);
  Harness<Redistributor> harness(&context, RedistributorText("feedback { enabled: true }"));
  Bind(&harness);
  const joint_command_t& out = harness.output<joint_command_t>();
  for (int tick = 0; tick < 50; ++tick) {
    harness.Run(TickAt(tick));
    Read(out);
  }
  const std::vector<double> held = out.feedback_torque;
  harness.Run(TickAt(57));
  EXPECT_EQ(out.feedback_torque, held);
  Read(out);
  harness.Run(TickAt(58));
  EXPECT_NE(out.feedback_torque, held);
}

TEST(InternalFeedback, RefusesGainsThatCannotBe) {
  ControlContext context(robot::TestRobot::kDyros);
  const auto field_of = [&](const std::string& config) -> std::string {
    try {
      Harness<Redistributor> harness(&context, RedistributorText(config));
    } catch (const ConfigError& error) {
      return error.field();
    }
    return "accepted";
  };
  EXPECT_EQ(field_of("feedback { integral: -1 }"), "feedback.integral");
  EXPECT_EQ(field_of("feedback { enabled: true } redistribution: false"), "feedback.enabled");
  EXPECT_EQ(field_of("feedback { enabled: true }"), "accepted");
}

}  // namespace
}  // namespace poise
