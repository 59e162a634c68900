// The ratio of (61) led by a schedule.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "components/messages/conversions.h"
#include "tests/components/redistributor_chain.h"

namespace poise {
namespace {

using robot::TestRobot;

// Level feet and the COM above their middle: M_x of a foot is (η − 1/2) F_z times the feet's
// distance, so the interval is 1/2 ± half width / distance, and the ratio's way through it is known
// in closed form.
TEST(RatioMoves, LeadTheRatioFromEndToEnd) {
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(false),
              RedistributorText("ratio_move { start: 0.1 duration: 0.2 position: 1 } "
                                "ratio_move { start: 0.4 duration: 0.3 position: 0 }"));
  const robot::RobotState standing = StandingState(chain.model());
  const Dynamics dynamics(chain.model(), standing, {true, true});
  const auto& sole = dynamics.data.foot_pose;
  const double reach = 0.05 / (sole[1].translation() - sole[0].translation()).y();
  const auto minimum_jerk = [](double s) {
    return 10 * std::pow(s, 3) - 15 * std::pow(s, 4) + 6 * std::pow(s, 5);
  };
  double last = 0.5;
  for (int tick = 0; tick <= 400; ++tick) {
    const joint_command_t& out = chain.Run(standing, tick);
    const double time = TickAt(tick).time;
    const double up = minimum_jerk(std::clamp((time - 0.1) / 0.2, 0.0, 1.0));
    const double down = minimum_jerk(std::clamp((time - 0.4) / 0.3, 0.0, 1.0));
    ASSERT_NEAR(out.eta, 0.5 + reach * (up - 2 * down), 1e-6) << time;
    // 15/8 of the mean speed at most.
    ASSERT_LE(std::abs(out.eta - last), 15.0 / 8.0 * 2 * reach * 0.002 / 0.3 + 1e-6) << time;
    last = out.eta;
    ASSERT_EQ(out.status, joint_command_t::STATUS_OK);
    ASSERT_EQ(out.conditions_met[0] + out.conditions_met[1], 2) << time;
    if (time >= 0.3 && time <= 0.4) {
      EXPECT_NEAR(out.eta, out.eta_max, 1e-12);
    } else if (time >= 0.7) {
      EXPECT_NEAR(out.eta, out.eta_min, 1e-12);
    }
    const Eigen::Isometry3d frame_o = GetPose(chain.balance().frame_o);
    balance::Vector6d sum = balance::Vector6d::Zero();
    for (size_t i = 0; i < 2; ++i) {
      sum += balance::WrenchTransform(frame_o, sole[i]) * GetWrench(out.foot_wrench[i]);
    }
    ASSERT_LT((sum - GetWrench(chain.balance().resultant)).norm(), 1e-9) << time;
    if (tick % 50 != 0) continue;
    Eigen::VectorXd before, after, wrench;
    dynamics.Forward(ToEigen(chain.balance().torque), &before, &wrench);
    dynamics.Forward(ToEigen(out.torque), &after, &wrench);
    EXPECT_LT((after - before).norm(), 1e-7);
    EXPECT_NEAR(wrench[2] / (wrench[2] + wrench[8]), out.eta, 1e-6);
  }
}

// One tick of a redistributor alone, its neighbours' messages given.
joint_command_t RunAlone(const std::string& extra, double time, const robot_state_t& state,
                         const support_plan_t& plan, const balance_torque_t& balance) {
  ControlContext context(TestRobot::kDyros);
  Harness<Redistributor> alone(&context, RedistributorText(extra));
  alone.Bind("robot_state", &state);
  alone.Bind("support_plan", &plan);
  alone.Bind("balance_torque", &balance);
  alone.Run(TickAt(std::llround(time * 1e6) / kTickMicroseconds));
  return alone.output<joint_command_t>();
}

TEST(RatioMoves, LeaveAnInfeasibleTickAlone) {
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(false), RedistributorText());
  chain.Run(StandingState(chain.model()), 0);
  const std::string moves = "ratio_move { start: 0.1 duration: 0.2 position: 1 }";
  balance_torque_t balance = chain.balance();
  const auto run = [&](const std::string& extra) {
    return RunAlone(extra, 0.2, chain.state(), chain.plan(), balance);
  };
  EXPECT_GT(run(moves).eta, run("").eta + 0.05);
  EXPECT_EQ(run(moves + " redistribution: false").torque, balance.torque);
  balance.resultant.moment[0] = -0.03 * balance.resultant.force[2];
  balance.resultant.moment[1] = 0.3 * balance.resultant.force[2];  // CoP 0.3 m ahead
  ASSERT_EQ(run("").status, joint_command_t::STATUS_INFEASIBLE);
  EXPECT_EQ(run(moves).eta, run("").eta);
  EXPECT_EQ(run(moves).torque, run("").torque);
}

TEST(RatioMoves, ATransitionRampsFromWhereTheyStand) {
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(false), RedistributorText());
  chain.Run(StandingState(chain.model()), 0);
  support_plan_t plan = chain.plan();
  const auto run = [&] {
    return RunAlone("ratio_move { start: 0.1 duration: 0.2 position: 0.25 }", 0.5, chain.state(),
                    plan, chain.balance());
  };
  const joint_command_t before = run();
  EXPECT_NEAR(before.eta, 0.75 * before.eta_min + 0.25 * before.eta_max, 1e-12);
  plan.transition = support_plan_t::TRANSITION_UNLOADING;
  plan.transition_foot = 1;
  plan.transition_progress = 0;
  EXPECT_NEAR(run().eta, before.eta, 1e-12);
}

TEST(RatioMoves, RefuseAScheduleThatCannotBe) {
  const std::string first = "ratio_move { start: 1 duration: 2 position: 1 } ";
  EXPECT_EQ(RefusedField(first), "accepted");
  EXPECT_EQ(RefusedField(first + "ratio_move { start: 3 duration: 1 position: 0 }"), "accepted");
  EXPECT_EQ(RefusedField(first + "ratio_move { start: 2.9 duration: 1 position: 0 }"),
            "ratio_move[1].start");
  EXPECT_EQ(RefusedField(first + "ratio_move { start: 0 duration: 1 position: 0 }"),
            "ratio_move[1].start");
  EXPECT_EQ(RefusedField("ratio_move { duration: 1 position: 0 }"), "ratio_move[0].start");
  EXPECT_EQ(RefusedField("ratio_move { start: -1 duration: 1 position: 0 }"),
            "ratio_move[0].start");
  EXPECT_EQ(RefusedField("ratio_move { start: inf duration: 1 position: 0 }"),
            "ratio_move[0].start");
  EXPECT_EQ(RefusedField("ratio_move { start: 1 position: 0 }"), "ratio_move[0].duration");
  EXPECT_EQ(RefusedField("ratio_move { start: 1 duration: 0 position: 0 }"),
            "ratio_move[0].duration");
  EXPECT_EQ(RefusedField("ratio_move { start: 1 duration: inf position: 0 }"),
            "ratio_move[0].duration");
  EXPECT_EQ(RefusedField("ratio_move { start: 1 duration: 1 }"), "ratio_move[0].position");
  EXPECT_EQ(RefusedField("ratio_move { start: 1 duration: 1 position: 1.1 }"),
            "ratio_move[0].position");
  EXPECT_EQ(RefusedField("ratio_move { start: 1 duration: 1 position: nan }"),
            "ratio_move[0].position");
}

}  // namespace
}  // namespace poise
