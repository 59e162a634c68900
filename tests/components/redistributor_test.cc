// The whole of planner, task controller, monitor and redistributor against the independent route:
// accelerations from tasks and contacts alone, the resultant from the base rows, the joint torques
// from the joint rows.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "components/balance/distribution_ratio.h"
#include "components/balance/support_polygon.h"
#include "components/messages/conversions.h"
#include "components/redistributor/internal_feedback.h"
#include "components/redistributor/redistributor.pb.h"
#include "tests/components/redistributor_chain.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using robot::TestRobot;

struct Case {
  TestRobot robot;
  const char* support;
  Contacts in_contact;
};

class ChainCase : public testing::TestWithParam<Case> {
 protected:
  std::string Phases() const {
    return std::string("phase { support: ") + GetParam().support + " }";
  }
  std::mt19937 random_{TestSeed(23)};
};

// The independent route of docs/reference/equations/redistribution.md: no matrix of section 3 is
// formed.
class SquareRoute : public ChainCase {};

TEST_P(SquareRoute, GivesTheSameTorqueAndWrenches) {
  double worst_torque = 0, worst_wrench = 0;
  int compared = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Chain chain(GetParam().robot, Phases(), MonitorConfig(false), RedistributorText());
    const robot::RobotModel& model = chain.model();
    const robot::RobotState first = Disturbed(StandingState(model), 0.03, 0.2, &random_);
    chain.Run(first, 0);
    const robot::RobotState now = Disturbed(first, 0.02, 0.2, &random_);
    const joint_command_t& out = chain.Run(now, 1);
    ASSERT_NE(out.status, joint_command_t::STATUS_INVALID_INPUT);
    // Where a motor can hold no more, less of the load is moved than (62)-(67) say.
    const Eigen::ArrayXd used =
        ToEigen(out.torque).array().abs() / robot::PeakTorques(model).array();
    if (((used - (1 - 1e-6)).abs() < 1e-9).any()) continue;
    ++compared;

    const Dynamics start(model, first, GetParam().in_contact);
    const Dynamics dynamics(model, now, GetParam().in_contact);
    const robot::RobotData& d = dynamics.data;
    const Eigen::Index n = model.num_velocities(), contacts = dynamics.contact_jacobian.rows();
    // [J; J_c] q̈ = [f* − J̇q̇; −J̇_c q̇]; the body is the base of this robot.
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    const auto rotation_vector = [](const Eigen::Matrix3d& r) -> Eigen::Vector3d {
      const Eigen::AngleAxisd a(r);
      return a.angle() * a.axis();
    };
    system.topRows<3>() = d.com_jacobian;
    right.head<3>() =
        225 * (start.data.com - d.com) - 10 * d.com_velocity - d.com_bias_acceleration;
    system.block<3, 3>(3, 3).setIdentity();
    right.segment<3>(3) =
        150 * rotation_vector(start.data.body_rotation[0] * d.body_rotation[0].transpose()) -
        20 * now.base_angular_velocity;
    Eigen::Index row = 6;
    for (size_t i = 0; i < 2; ++i) {
      if (GetParam().in_contact[i]) continue;
      const Eigen::Isometry3d &at = d.foot_pose[i], &to = start.data.foot_pose[i];
      Eigen::VectorXd error(6);
      error << to.translation() - at.translation(),
          rotation_vector(to.linear() * at.linear().transpose());
      system.middleRows<6>(row) = d.foot_jacobian[i];
      right.segment<6>(row) = 100 * error - 15 * d.foot_velocity[i] - d.foot_bias_acceleration[i];
      row += 6;
    }
    ASSERT_EQ(row + contacts, n);
    system.bottomRows(contacts) = dynamics.contact_jacobian;
    right.tail(contacts) = -dynamics.contact_bias;
    const Eigen::VectorXd acceleration = system.fullPivLu().solve(right);

    // Generalised force without torque: its base rows are −J_cᵀ F of the feet together.
    const Eigen::VectorXd force = d.mass_matrix * acceleration + d.bias + d.gravity;
    const Eigen::Vector3d f = -force.head<3>();
    const Eigen::Vector3d m = -force.segment<3>(3);  // about the base's origin
    Eigen::VectorXd wrench(contacts);
    const std::array<double, 2> share{GetParam().in_contact[1] ? out.eta : 1.0,
                                      GetParam().in_contact[0] ? 1 - out.eta : 1.0};
    // (62)-(67): both feet take their share of the force and of the sum of their own moments.
    Eigen::Vector3d own = m;
    for (size_t i = 0; i < 2; ++i) {
      if (!GetParam().in_contact[i]) continue;
      own -= (d.foot_pose[i].translation() - now.base_position).cross(share[i] * f);
    }
    row = 0;
    for (size_t i = 0; i < 2; ++i) {
      if (!GetParam().in_contact[i]) continue;
      const Eigen::Matrix3d to_sole = d.foot_pose[i].linear().transpose();
      wrench.segment<3>(row) = to_sole * (share[i] * f);
      wrench.segment<3>(row + 3) = to_sole * (share[i] * own);
      worst_wrench =
          std::max(worst_wrench, (GetWrench(out.foot_wrench[i]) - wrench.segment<6>(row)).norm());
      row += 6;
    }
    const Eigen::VectorXd torque =
        (force + dynamics.contact_jacobian.transpose() * wrench).tail(model.num_joints());
    worst_torque = std::max(worst_torque, (torque - ToEigen(out.torque)).norm());
  }
  EXPECT_GT(compared, 80);        // of 200 random states
  EXPECT_LT(worst_torque, 1e-7);  // N·m, of some 100
  EXPECT_LT(worst_wrench, 1e-7);  // N, N·m, of some 500
  RecordProperty("worst_torque", testing::PrintToString(worst_torque));
}

INSTANTIATE_TEST_SUITE_P(All, SquareRoute,
                         testing::Values(Case{TestRobot::kDyros, "DOUBLE", {true, true}},
                                         Case{TestRobot::kDyros, "RIGHT", {true, false}},
                                         Case{TestRobot::kDyros, "LEFT", {false, true}}),
                         [](const auto& info) { return std::string(info.param.support); });

// With everything switched on, for any robot: the commanded torque gives the wrenches that the
// command announces, the margins are those wrenches' margins, and moving wrench between the feet
// moves nothing else.
TEST_P(ChainCase, TheCommandGivesWhatItAnnounces) {
  int feasible = 0, checked = 0;
  double worst = 0;
  for (int trial = 0; trial < 100; ++trial) {
    Chain chain(GetParam().robot, Phases(), MonitorConfig(true, 0.08, 0.07), RedistributorText());
    const robot::RobotState first = Disturbed(StandingState(chain.model()), 0.02, 0.1, &random_);
    chain.Run(first, 0);
    const robot::RobotState now = Disturbed(first, 0.01, 0.2, &random_);
    const joint_command_t& out = chain.Run(now, 1);
    if (chain.balance().status != balance_torque_t::STATUS_OK) continue;
    ++checked;
    const Dynamics dynamics(chain.model(), now, GetParam().in_contact);
    Eigen::VectorXd before_q, before, after_q, after;
    dynamics.Forward(ToEigen(chain.balance().torque), &before_q, &before);
    dynamics.Forward(ToEigen(out.torque), &after_q, &after);
    worst = std::max(worst, (after_q - before_q).norm());
    Eigen::Index row = 0;
    for (size_t i = 0; i < 2; ++i) {
      const balance::Vector6d wrench = GetWrench(out.foot_wrench[i]);
      ASSERT_EQ(out.in_contact[i] != 0, GetParam().in_contact[i]);
      if (!GetParam().in_contact[i]) {
        EXPECT_EQ(wrench.norm(), 0);
        EXPECT_EQ(out.conditions_met[i], 1);
        EXPECT_EQ(out.margins[i].normal, 0);
        continue;
      }
      worst = std::max(worst, (wrench - after.segment<6>(row)).norm());
      row += 6;
      const double load = std::abs(wrench[2]);
      const double width = GetParam().in_contact[0] && GetParam().in_contact[1] ? 0.05 : 0.06;
      const std::array<double, 5> margins{
          -wrench[2], 0.9 * load - wrench.head<2>().norm(), 0.9 * load - std::abs(wrench[5]),
          width * load - std::abs(wrench[3]), 0.12 * load - std::abs(wrench[4])};
      const contact_margins_t& got = out.margins[i];
      const std::array<double, 5> announced{got.normal, got.friction, got.yaw, got.roll, got.pitch};
      for (size_t k = 0; k < 5; ++k) EXPECT_NEAR(announced[k], margins[k], 1e-9);
      EXPECT_EQ(out.conditions_met[i] != 0,
                *std::min_element(margins.begin(), margins.end()) >= -1e-6);
    }
    if (!GetParam().in_contact[0] || !GetParam().in_contact[1]) {
      EXPECT_EQ(out.torque, chain.balance().torque);
      EXPECT_EQ(out.eta, GetParam().in_contact[0] ? 1 : 0);
      continue;
    }
    if (out.eta_feasible != 0) {
      ++feasible;
      EXPECT_EQ(out.status, joint_command_t::STATUS_OK);
      EXPECT_EQ(out.conditions_met[0] + out.conditions_met[1], 2);
      EXPECT_GE(out.eta, out.eta_min);
      EXPECT_LE(out.eta, out.eta_max);
    } else {
      EXPECT_EQ(out.status, joint_command_t::STATUS_INFEASIBLE);
      EXPECT_EQ(out.eta_min, 0);
      EXPECT_EQ(out.eta_max, 1);
    }
    EXPECT_GE(out.eta, 0.02);
    EXPECT_LE(out.eta, 0.98);
  }
  EXPECT_GT(checked, 50);
  EXPECT_LT(worst, 1e-7);
  if (GetParam().in_contact[0] && GetParam().in_contact[1]) {
    EXPECT_GT(feasible, 10);
  }
}

INSTANTIATE_TEST_SUITE_P(All, ChainCase,
                         testing::Values(Case{TestRobot::kDyros, "DOUBLE", {true, true}},
                                         Case{TestRobot::kDyros, "RIGHT", {true, false}},
                                         Case{TestRobot::kDyros, "LEFT", {false, true}},
                                         Case{TestRobot::kMantis, "DOUBLE", {true, true}},
                                         Case{TestRobot::kMantis, "LEFT", {false, true}}),
                         [](const auto& info) {
                           return std::string(info.param.robot == TestRobot::kDyros ? "Dyros"
                                                                                    : "Mantis") +
                                  info.param.support;
                         });

// Level feet and an η between its bounds: neither foot carries a moment about x (figures 11, 12 of
// the paper).
TEST(Redistributor, FreesBothFeetOfRollMoment) {
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(true), RedistributorText());
  const robot::RobotState standing = StandingState(chain.model());
  const joint_command_t& out = chain.Run(standing, 0);
  ASSERT_EQ(out.status, joint_command_t::STATUS_OK);
  EXPECT_NEAR(out.eta, 0.5, 1e-6);
  EXPECT_EQ(out.eta, out.eta_optimal);
  for (size_t i = 0; i < 2; ++i) EXPECT_NEAR(out.foot_wrench[i].moment[0], 0, 1e-9);
  EXPECT_NEAR(out.foot_wrench[0].force[2] + out.foot_wrench[1].force[2],
              -chain.model().total_mass() * robot::kGravity, 1e-6);
}

TEST(Redistributor, PassesThroughWhenSwitchedOff) {
  std::mt19937 random(TestSeed(24));
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(true),
              RedistributorText("redistribution: false"));
  int checked = 0;
  for (int tick = 0; tick < 20; ++tick) {
    const robot::RobotState now = Disturbed(StandingState(chain.model()), 0.01, 0.1, &random);
    const joint_command_t& out = chain.Run(now, tick);
    if (chain.balance().status != balance_torque_t::STATUS_OK) continue;
    ++checked;
    EXPECT_EQ(out.torque, chain.balance().torque);
    EXPECT_EQ(ToEigen(out.redistribution_torque).norm(), 0);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(GetWrench(out.foot_wrench[i]), GetWrench(chain.balance().foot_wrench[i]));
    }
  }
  EXPECT_GT(checked, 10);
}

// Section 7.4: the COM near the stance foot but not above its middle, the left foot unloaded in
// 0.1-0.3 s, single support from 0.3 s. The largest step of a torque from tick to tick, and the
// left foot's load before the switch.
struct Switch {
  double largest_step = 0;  // N·m, at the switch
  double ramp_step = 0;     // N·m, before it
  double load_before = 0;   // N
};

Switch LiftTheLeftFoot(const std::string& redistributor, double com_offset) {
  Chain chain(TestRobot::kDyros,
              "phase { duration: 0.3 transition { kind: UNLOAD foot: LEFT_FOOT delay: 0.1 "
              "duration: 0.2 } } phase { support: RIGHT }",
              MonitorConfig(false), redistributor);
  robot::RobotState state = StandingState(chain.model());
  const robot::RobotData data = robot::Evaluate(chain.model(), state);
  // The soles stay where they are and the COM moves: inverse kinematics by Newton steps on COM,
  // body and soles.
  robot::RobotState posture = state;
  const double target = data.foot_pose[0].translation().y() + com_offset;
  for (int iteration = 0; iteration < 30; ++iteration) {
    const robot::RobotData now = robot::Evaluate(chain.model(), posture);
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(18, 18);
    Eigen::VectorXd error = Eigen::VectorXd::Zero(18);
    jacobian.topRows<3>() = now.com_jacobian;
    error.head<3>() = Eigen::Vector3d(data.com.x(), target, data.com.z()) - now.com;
    jacobian.block<3, 3>(3, 3).setIdentity();
    for (size_t i = 0; i < 2; ++i) {
      const auto row = static_cast<Eigen::Index>(6 + 6 * i);
      jacobian.middleRows<6>(row) = now.foot_jacobian[i];
      error.segment<3>(row) = data.foot_pose[i].translation() - now.foot_pose[i].translation();
      const Eigen::AngleAxisd turn(data.foot_pose[i].linear() *
                                   now.foot_pose[i].linear().transpose());
      error.segment<3>(row + 3) = turn.angle() * turn.axis();
    }
    posture = robot::Moved(posture, jacobian.fullPivLu().solve(error), 1.0);
  }
  Switch result;
  Eigen::VectorXd last;
  for (int tick = 0; tick < 160; ++tick) {
    const joint_command_t& out = chain.Run(posture, tick);
    EXPECT_EQ(chain.task().status, task_torque_t::STATUS_OK);
    const Eigen::VectorXd torque = ToEigen(out.torque);
    if (tick > 0) {
      const double step = (torque - last).cwiseAbs().maxCoeff();
      double& largest = tick == 150 ? result.largest_step : result.ramp_step;
      largest = std::max(largest, step);
    }
    if (tick == 149) result.load_before = std::abs(out.foot_wrench[1].force[2]);
    EXPECT_EQ(out.in_contact[1] != 0, tick < 150);
    last = torque;
  }
  return result;
}

TEST(Redistributor, TheRampTakesTheTorqueJumpOutOfTheSwitch) {
  const Switch with = LiftTheLeftFoot(RedistributorText(), 0.03);
  const Switch without = LiftTheLeftFoot(RedistributorText("transition: false"), 0.03);
  EXPECT_GT(without.load_before, 50);
  EXPECT_LT(with.load_before, 0.01);
  EXPECT_GT(without.largest_step, 5);
  EXPECT_LT(with.largest_step, 0.01);
  EXPECT_LT(with.ramp_step, 1.5);  // N·m per tick: 0.2 s for some 30 N·m
  RecordProperty("jump_with", testing::PrintToString(with.largest_step));
  RecordProperty("jump_without", testing::PrintToString(without.largest_step));
}

/// The redistributor alone while a standing robot's left foot is unloaded.
struct Unloading {
  Chain chain{TestRobot::kDyros, "phase { }", MonitorConfig(false), RedistributorText()};
  ControlContext context{TestRobot::kDyros};
  Harness<Redistributor> alone{&context, RedistributorText()};
  support_plan_t plan;
  balance_torque_t balance;

  Unloading() {
    chain.Run(StandingState(chain.model()), 0);
    plan = chain.plan();
    plan.transition = support_plan_t::TRANSITION_UNLOADING;
    plan.transition_foot = 1;
    balance = chain.balance();
    alone.Bind("robot_state", &chain.state());
    alone.Bind("support_plan", &plan);
    alone.Bind("balance_torque", &balance);
  }
};

// Balancing leaves a joint half of what redistribution would add to its torque: half of the load is
// moved, and η says so.
TEST(Redistributor, MovesNoMoreLoadThanTheMotorsCanHold) {
  Unloading unloading;
  auto& [chain, context, alone, plan, balance] = unloading;
  plan.transition_progress = 0.9;
  alone.Run(TickAt(0));
  const joint_command_t free = alone.output<joint_command_t>();
  size_t most = 0;
  for (size_t j = 0; j < free.torque.size(); ++j) {
    if (std::abs(free.redistribution_torque[j]) > std::abs(free.redistribution_torque[most])) {
      most = j;
    }
  }
  const double change = free.redistribution_torque[most];
  ASSERT_GT(std::abs(change), 5);
  const double limit = robot::PeakTorques(chain.model())[static_cast<Eigen::Index>(most)];
  balance.torque[most] = std::copysign(limit, change) - 0.5 * change;
  alone.Run(TickAt(1));
  const auto& out = alone.output<joint_command_t>();
  EXPECT_NEAR(std::abs(out.torque[most]), limit, 1e-5 * limit);
  EXPECT_LT(std::abs(out.torque[most]), limit);
  const double before = balance.foot_wrench[0].force[2];
  EXPECT_NEAR(out.foot_wrench[0].force[2] - before, 0.5 * (free.foot_wrench[0].force[2] - before),
              0.1);
  EXPECT_NEAR(out.eta, out.foot_wrench[0].force[2] / balance.resultant.force[2], 1e-3);
}

// The COM further from the stance sole's centre than the sole's reduced half width: the ramp stops
// at the last ratio that the stance foot can bear.
TEST(Redistributor, TheRampEndsWhereTheStanceFootWouldTip) {
  Unloading unloading;
  auto& [chain, context, alone, plan, balance] = unloading;
  double last = 0.5;
  for (double progress : {0.0, 0.3, 0.6, 1.0}) {
    plan.transition_progress = progress;
    alone.Run(TickAt(0));
    const auto& out = alone.output<joint_command_t>();
    EXPECT_GE(out.eta, last - 1e-9);
    EXPECT_EQ(out.conditions_met[0], 1);
    last = out.eta;
  }
  // Lever: M_x of the right foot per load = its distance from the CoP, less the left foot's share
  // of the width.
  const robot::RobotData data = robot::Evaluate(chain.model(), StandingState(chain.model()));
  const double width = (data.foot_pose[1].translation() - data.foot_pose[0].translation()).y();
  EXPECT_NEAR(last, 0.5 + 0.05 / width, 1e-6);
}

TEST(Redistributor, HoldsTheLastCommandWhenItsNeighboursHaveNone) {
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(true), RedistributorText());
  const robot::RobotState standing = StandingState(chain.model());
  const std::vector<double> good = chain.Run(standing, 0).torque;
  ASSERT_GT(ToEigen(chain.Run(standing, 1).redistribution_torque).norm(), 0);
  chain.state().joint_position[2] = std::numeric_limits<double>::quiet_NaN();
  const joint_command_t& out = chain.RunMessage(2);
  EXPECT_EQ(out.status, joint_command_t::STATUS_INVALID_INPUT);
  EXPECT_EQ(out.torque, good);
  EXPECT_TRUE(MessageTraits<joint_command_t>::AllFinite(out));
  EXPECT_EQ(chain.Run(standing, 3).status, joint_command_t::STATUS_OK);
}

TEST(Redistributor, ALegYieldsWhoseFootLosesItsLoad) {
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(true),
              RedistributorText() + " yielding_legs: true");
  const robot::RobotState standing = StandingState(chain.model());
  chain.Run(standing, 0);
  const auto run = [&](double left, int64_t from) {
    for (int64_t tick = from; tick < from + 50; ++tick) {
      chain.state().foot_wrench[0].force[2] = -300;
      chain.state().foot_wrench[1].force[2] = -left;
      chain.RunMessage(tick);
    }
    return chain.RunMessage(from + 50);
  };
  const joint_command_t borne = run(300, 1), lost = run(0, 60);
  const auto joint = [&](const char* name) {
    return static_cast<size_t>(chain.model().FindJoint(name));
  };
  EXPECT_NE(borne.torque[joint("left_knee_pitch")], 0);
  EXPECT_NEAR(lost.torque[joint("left_knee_pitch")], 0, 0.01) << "at rest nothing is damped";
  EXPECT_EQ(lost.torque[joint("right_knee_pitch")], borne.torque[joint("right_knee_pitch")]);
  EXPECT_EQ(lost.foot_wrench[1].force[2], borne.foot_wrench[1].force[2]);
  EXPECT_EQ(lost.redistribution_torque, borne.redistribution_torque);
}

// The COM above the right foot would leave the left one the 2 % of eta_max.
TEST(Redistributor, ALandedFootKeepsItsShareUntilItLeavesTheGround) {
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(false), RedistributorText());
  chain.Run(StandingState(chain.model()), 0);
  support_plan_t plan = chain.plan();
  balance_torque_t balance = chain.balance();
  const robot::RobotData standing = robot::Evaluate(chain.model(), StandingState(chain.model()));
  const auto sole_y = [&](size_t i) {
    return (GetPose(balance.frame_o).inverse() * standing.foot_pose[i]).translation().y();
  };
  ControlContext context(TestRobot::kDyros);
  Harness<Redistributor> alone(&context, RedistributorText("landed_share: 0.1"));
  alone.Bind("robot_state", &chain.state());
  alone.Bind("support_plan", &plan);
  alone.Bind("balance_torque", &balance);
  const auto ratio_with_cop_at = [&](double y) {
    balance.resultant.moment[0] = balance.resultant.force[2] * y;
    alone.Run(TickAt(0));
    return alone.output<joint_command_t>().eta;
  };
  const auto transition = [&](int8_t kind, int8_t foot, double progress) {
    plan.transition = kind;
    plan.transition_foot = foot;
    plan.transition_progress = progress;
  };
  const double right = sole_y(0), left = sole_y(1);
  EXPECT_NEAR(ratio_with_cop_at(right), 0.98, 1e-9);  // not landed

  transition(support_plan_t::TRANSITION_LOADING, 1, 0);
  EXPECT_NEAR(ratio_with_cop_at(right), 1, 1e-9);  // no load yet
  transition(support_plan_t::TRANSITION_NONE, -1, 0);
  EXPECT_NEAR(ratio_with_cop_at(right), 0.9, 1e-9);
  EXPECT_NEAR(ratio_with_cop_at(0), 0.5, 1e-6);  // (71): no more than the least share
  EXPECT_NEAR(ratio_with_cop_at(left), 0.02, 1e-9);
  // The right foot may bear M_x up to 0.05 m of its load: with the centre of pressure beyond that
  // only eta_max remains.
  EXPECT_NEAR(ratio_with_cop_at(right - 0.048), 0.98, 0.01);

  plan.in_contact[1] = 0;  // lifted
  alone.Run(TickAt(1));
  plan.in_contact[1] = 1;
  EXPECT_NEAR(ratio_with_cop_at(right), 0.98, 1e-9);

  transition(support_plan_t::TRANSITION_LOADING, 0, 1);
  ratio_with_cop_at(left);
  transition(support_plan_t::TRANSITION_NONE, -1, 0);
  EXPECT_NEAR(ratio_with_cop_at(left), 0.1, 1e-9);
}

// The centre of pressure 49 mm beside the right sole's middle, which bears 50: with 2 % of the load
// on the other foot the right one's own would lie 2 % of the soles' distance farther out.
TEST(Redistributor, OnARampAFootMayCarryNothing) {
  Chain chain(TestRobot::kDyros, "phase { }", MonitorConfig(false), RedistributorText());
  chain.Run(StandingState(chain.model()), 0);
  support_plan_t plan = chain.plan();
  balance_torque_t balance = chain.balance();
  ControlContext context(TestRobot::kDyros);
  Harness<Redistributor> alone(&context, RedistributorText());
  alone.Bind("robot_state", &chain.state());
  alone.Bind("support_plan", &plan);
  alone.Bind("balance_torque", &balance);
  const robot::RobotData standing = robot::Evaluate(chain.model(), StandingState(chain.model()));
  const double right =
      (GetPose(balance.frame_o).inverse() * standing.foot_pose[0]).translation().y();
  const auto with_cop_at = [&](double y) -> const joint_command_t& {
    balance.resultant.moment[0] = balance.resultant.force[2] * y;
    alone.Run(TickAt(0));
    return alone.output<joint_command_t>();
  };
  EXPECT_EQ(with_cop_at(right - 0.049).status, joint_command_t::STATUS_INFEASIBLE);
  plan.transition = support_plan_t::TRANSITION_LOADING;
  plan.transition_foot = 1;
  plan.transition_progress = 0;
  const joint_command_t& out = with_cop_at(right - 0.049);
  EXPECT_EQ(out.status, joint_command_t::STATUS_OK);
  EXPECT_EQ(out.eta_feasible, 1);
  EXPECT_EQ(out.conditions_met[0] + out.conditions_met[1], 2);
  EXPECT_NEAR(out.eta, 1, 1e-9);
  EXPECT_EQ(with_cop_at(right - 0.051).status, joint_command_t::STATUS_INFEASIBLE);
}

TEST(Redistributor, RefusesRatiosThatCannotBe) {
  EXPECT_EQ(RefusedField("landed_share: -0.1"), "landed_share");
  EXPECT_EQ(RefusedField("landed_share: 0.5"), "landed_share");
  EXPECT_EQ(RefusedField("landed_share: nan"), "landed_share");
  EXPECT_EQ(RefusedField("eta_min: -0.1"), "eta_min");
  EXPECT_EQ(RefusedField("eta_max: 1.1"), "eta_max");
  EXPECT_EQ(RefusedField("eta_max: nan"), "eta_max");
  EXPECT_EQ(RefusedField("eta_min: 0.6 eta_max: 0.4"), "eta_min");
  EXPECT_EQ(RefusedField("eta_min: 0 eta_max: 1"), "accepted");
}

// What is derived for the monitor and for the redistributor fits: wherever in the soles' hull the
// monitor leaves the centre of pressure, some eta serves both feet.
TEST(Redistributor, EveryPointOfTheDerivedRegionCanBeShared) {
  for (const TestRobot robot : {TestRobot::kDyros, TestRobot::kMantis}) {
    const robot::RobotModel model = robot::LoadTestRobot(robot);
    const double margin = HullMargin(model);
    const balance::SoleLimits limits =
        ReadSoleLimits({}, model, SoleMargin(model), "double_support");
    const robot::RobotData data = robot::Evaluate(model, StandingState(model));
    const balance::ContactGeometry geometry{{data.foot_pose[0], data.foot_pose[1]}, {true, true}};
    Eigen::Isometry3d frame_o;
    ASSERT_TRUE(balance::FrameO(geometry.sole, geometry.in_contact, &frame_o));
    std::array<balance::ConvexPolygon, 2> reduced;
    std::array<Eigen::Isometry3d, 2> sole;
    for (size_t i = 0; i < 2; ++i) {
      reduced[i] = balance::SolePolygon(model.feet()[i], margin);
      sole[i] = frame_o.inverse() * geometry.sole[i];
    }
    const balance::ConvexPolygon region = balance::SupportPolygon(frame_o, geometry, reduced);
    ASSERT_GE(region.num_corners, 4);
    for (const Eigen::Vector2d& cop : region.corners()) {
      balance::Vector6d resultant = balance::Vector6d::Zero();
      resultant[2] = -500;
      resultant[3] = -500 * cop.y();
      resultant[4] = 500 * cop.x();
      ASSERT_LT((balance::CenterOfPressure(resultant) - cop).norm(), 1e-12);
      const auto interval = balance::FeasibleRatio(resultant, sole, limits, 0.02, 0.98);
      EXPECT_TRUE(interval.feasible)
          << model.name() << ": " << cop.transpose() << ": " << interval.limiting_condition;
    }
  }
}

TEST(Redistributor, LimitsOfTheFeedbackAreThoseOfTheRobot) {
  // The paper's robot has what the fields had by default before they were derived.
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  EXPECT_NEAR(SoleMargin(model), 0.005, 1e-12);
  const balance::ContactLimits limits = ReadLimits(WithinSoles({}, model, 0.005), "");
  EXPECT_NEAR(limits.half_length, 0.145, 1e-12);
  EXPECT_NEAR(limits.half_width, 0.07, 1e-12);
  const FeedbackLimits feedback = LimitsOfFeedback(model);
  EXPECT_EQ(feedback.force, 100);
  EXPECT_EQ(feedback.moment, 30);
  EXPECT_NEAR(feedback.edge, 0.015, 1e-12);
}

}  // namespace
}  // namespace poise
