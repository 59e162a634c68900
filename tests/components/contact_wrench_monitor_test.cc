// The contact wrench monitor with faked neighbours, against the equations of motion solved
// directly.
#include "components/contact_wrench_monitor/contact_wrench_monitor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "components/balance/contact_conditions.h"
#include "components/messages/conversions.h"
#include "tests/components/control_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using robot::TestRobot;

struct Case {
  TestRobot robot;
  Contacts in_contact;
  const char* name;
};

class MonitorCase : public testing::TestWithParam<Case> {
 protected:
  MonitorCase()
      : model_(robot::LoadTestRobot(GetParam().robot)),
        context_(GetParam().robot),
        standing_(StandingState(model_)) {
    MessageTraits<task_torque_t>::Resize(task_, std::array{model_.num_joints()});
    MessageTraits<support_plan_t>::Resize(plan_, std::array{2});
    for (size_t i = 0; i < 2; ++i) plan_.in_contact[i] = GetParam().in_contact[i] ? 1 : 0;
  }

  void Run(Harness<ContactWrenchMonitor>* harness) {
    harness->Bind("robot_state", &state_);
    harness->Bind("support_plan", &plan_);
    harness->Bind("task_torque", &task_);
    harness->Run(TickAt(tick_++));
  }
  // Torque that holds a random state roughly still, plus something random.
  void Draw(double torque) {
    now_ = Disturbed(standing_, 0.05, 0.3, &random_);
    state_ = StateMessage(model_, now_);
    const Dynamics dynamics(model_, now_, GetParam().in_contact);
    std::uniform_real_distribution<double> uniform(-torque, torque);
    const Eigen::VectorXd hold =
        (dynamics.contact_jacobian.rightCols(model_.num_joints()).transpose() *
         (dynamics.contact_jacobian.leftCols<6>().transpose())
             .colPivHouseholderQr()
             .solve(-dynamics.data.gravity.head<6>()))
            .eval();
    for (int j = 0; j < model_.num_joints(); ++j) {
      task_.torque[static_cast<size_t>(j)] =
          dynamics.data.gravity[6 + j] + hold[j] + uniform(random_);
    }
  }
  // Force and moment of the feet's wrenches about frame O, summed in the world.
  Eigen::VectorXd Resultant(const robot::RobotData& data, const Eigen::VectorXd& wrench,
                            const Eigen::Isometry3d& frame) const {
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
    Eigen::Index row = 0;
    for (size_t i = 0; i < 2; ++i) {
      if (!GetParam().in_contact[i]) continue;
      const Eigen::Isometry3d& sole = data.foot_pose[i];
      const Eigen::Vector3d f = sole.linear() * wrench.segment<3>(row);
      force += f;
      moment += sole.linear() * wrench.segment<3>(row + 3) +
                (sole.translation() - frame.translation()).cross(f);
      row += 6;
    }
    Eigen::VectorXd result(6);
    result << frame.linear().transpose() * force, frame.linear().transpose() * moment;
    return result;
  }

  robot::RobotModel model_;
  ControlContext context_;
  robot::RobotState standing_, now_;
  robot_state_t state_;
  support_plan_t plan_{};
  task_torque_t task_{};
  int64_t tick_ = 0;
  std::mt19937 random_{TestSeed(21)};
};

// Whatever the task torque: wrenches, resultant and centre of pressure are what the equations of
// motion give, the centre of pressure ends on the nearest point of its rectangle, and neither the
// vertical force nor the COM's height acceleration change.
TEST_P(MonitorCase, PutsTheCentreOfPressureOnItsBoundAndLeavesTheHeightAlone) {
  Harness<ContactWrenchMonitor> harness(&context_, MonitorConfig(true));
  const Eigen::Vector2d limit = GetParam().in_contact[0] && GetParam().in_contact[1]
                                    ? Eigen::Vector2d(0.13, 0.07)
                                    : Eigen::Vector2d(0.12, 0.06);
  int active = 0, passive = 0;
  double worst_wrench = 0, worst_cop = 0, worst_height = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Draw(trial % 2 == 0 ? 3 : 30);
    Run(&harness);
    const auto& out = harness.output<balance_torque_t>();
    if (out.status == balance_torque_t::STATUS_NOT_ACHIEVED) {
      EXPECT_GE(out.resultant_task.force[2], 0);
      continue;
    }
    ASSERT_EQ(out.status, balance_torque_t::STATUS_OK);
    const Dynamics dynamics(model_, now_, GetParam().in_contact);
    Eigen::VectorXd before_q, before, after_q, after;
    dynamics.Forward(ToEigen(task_.torque), &before_q, &before);
    dynamics.Forward(ToEigen(out.torque), &after_q, &after);

    Eigen::Index row = 0;
    for (size_t i = 0; i < 2; ++i) {
      const auto wrench = GetWrench(out.foot_wrench[i]);
      if (!GetParam().in_contact[i]) {
        EXPECT_EQ(wrench.norm(), 0);
        continue;
      }
      worst_wrench = std::max(worst_wrench, (wrench - after.segment<6>(row)).norm());
      row += 6;
    }
    const Eigen::Isometry3d frame = GetPose(out.frame_o);
    const Eigen::VectorXd task = Resultant(dynamics.data, before, frame);
    const Eigen::VectorXd balanced = Resultant(dynamics.data, after, frame);
    worst_wrench = std::max({worst_wrench, (GetWrench(out.resultant_task) - task).norm(),
                             (GetWrench(out.resultant) - balanced).norm()});
    const Eigen::Vector3d force_change = frame.linear() * (balanced.head<3>() - task.head<3>());
    worst_height = std::max({worst_height, std::abs(force_change.z()),
                             std::abs((dynamics.data.com_jacobian * (after_q - before_q))[2])});
    const Eigen::Vector2d cop_task(-task[4] / task[2], task[3] / task[2]);
    const Eigen::Vector2d cop(-balanced[4] / balanced[2], balanced[3] / balanced[2]);
    const Eigen::Vector2d wanted = cop_task.cwiseMax(-limit).cwiseMin(limit);
    worst_cop = std::max({worst_cop, (cop - wanted).norm(),
                          (Eigen::Map<const Eigen::Vector2d>(out.cop) - wanted).norm(),
                          (Eigen::Map<const Eigen::Vector2d>(out.cop_task) - cop_task).norm()});
    EXPECT_EQ(out.active_x != 0, std::abs(cop_task.x()) > limit.x());
    EXPECT_EQ(out.active_y != 0, std::abs(cop_task.y()) > limit.y());
    EXPECT_EQ(out.cop_limit[0], limit.x());
    EXPECT_EQ(out.cop_limit[1], limit.y());
    EXPECT_EQ(out.region, balance_torque_t::REGION_RECTANGLE);
    ASSERT_EQ(out.num_corners, 4);
    for (const int i : {0, 1, 2, 3}) {
      EXPECT_EQ(std::abs(out.corner_x[i]), limit.x());
      EXPECT_EQ(std::abs(out.corner_y[i]), limit.y());
    }
    EXPECT_NEAR(out.resultant_margins.normal, -balanced[2], 1e-6);
    EXPECT_NEAR(out.resultant_margins.friction,
                0.9 * std::abs(balanced[2]) - balanced.head<2>().norm(), 1e-6);
    EXPECT_NEAR(out.resultant_margins.yaw, 0.9 * std::abs(balanced[2]) - std::abs(balanced[5]),
                1e-6);
    EXPECT_NEAR(out.resultant_margins.roll,
                limit.y() * std::abs(balanced[2]) - std::abs(balanced[3]), 1e-6);
    EXPECT_NEAR(out.resultant_margins.pitch,
                limit.x() * std::abs(balanced[2]) - std::abs(balanced[4]), 1e-6);
    EXPECT_LT((ToEigen(out.torque) - ToEigen(task_.torque) - ToEigen(out.balance_torque)).norm(),
              1e-12);
    const bool changed = ToEigen(out.balance_torque).norm() > 0;
    EXPECT_EQ(changed, out.active_x != 0 || out.active_y != 0);
    (changed ? active : passive) += 1;
  }
  EXPECT_GT(active, 20);
  if (GetParam().in_contact[0] && GetParam().in_contact[1]) {
    EXPECT_GT(passive, 5);
  }
  EXPECT_LT(worst_wrench, 1e-7);  // N, N·m
  EXPECT_LT(worst_height, 1e-8);
  EXPECT_LT(worst_cop, 1e-9);  // m
}

// While steps are made each sole keeps its own conditions: the wrenches that the dynamics give for
// the torque press, keep friction and its moment, and their centre of pressure is in the region.
TEST_P(MonitorCase, InAStepEachSoleKeepsWhatTheGroundGives) {
  plan_.com_follows = support_plan_t::FOLLOWS_COP;
  Harness<ContactWrenchMonitor> harness(&context_, "region: POLYGON sole_margin: 0.02");
  int active = 0, kept = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Draw(12);
    Run(&harness);
    const auto& out = harness.output<balance_torque_t>();
    if (out.status != balance_torque_t::STATUS_OK || !(out.active_x || out.active_y)) continue;
    const Dynamics dynamics(model_, now_, GetParam().in_contact);
    Eigen::VectorXd acceleration, wrench;
    dynamics.Forward(ToEigen(out.torque), &acceleration, &wrench);
    Eigen::Index row = 0;
    bool keeps = true;
    for (size_t i = 0; i < 2; ++i) {
      if (!GetParam().in_contact[i]) continue;
      const Eigen::VectorXd own = wrench.segment<6>(row);
      row += 6;
      const robot::FootModel& foot = model_.feet()[i];
      const double most = 0.9 * -own[2] * (1 + 1e-6);
      keeps = keeps && own[2] < 0 && own.head<2>().norm() < most &&
              std::abs(own[5]) < 0.5 * (foot.length + foot.width) * most;
    }
    kept += keeps ? 1 : 0;
    const Eigen::VectorXd resultant = Resultant(dynamics.data, wrench, GetPose(out.frame_o));
    const Eigen::Vector2d cop(-resultant[4] / resultant[2], resultant[3] / resultant[2]);
    EXPECT_LT((Eigen::Map<const Eigen::Vector2d>(out.cop) - cop).norm(), 1e-9);
    balance::ConvexPolygon region;
    region.num_corners = out.num_corners;
    for (int i = 0; i < out.num_corners; ++i) {
      region.corner[static_cast<size_t>(i)] = {out.corner_x[i], out.corner_y[i]};
    }
    EXPECT_GT(balance::SignedDistance(region, cop), -1e-6);
    ++active;
  }
  EXPECT_GT(active, 10);
  EXPECT_EQ(kept, active);
}

// The same for the hull of the soles, whatever the feet's heights and angles.
TEST_P(MonitorCase, PutsTheCentreOfPressureOnTheNearestPointOfTheSolesHull) {
  constexpr double kMargin = 0.045;
  // A sole that carries alone has another one.
  const double side = GetParam().in_contact[0] && GetParam().in_contact[1] ? kMargin : 0.03;
  Harness<ContactWrenchMonitor> harness(&context_,
                                        "region: POLYGON sole_margin: 0.045 side_margin: 0.03");
  int active = 0;
  double worst_cop = 0, worst_corner = 0, worst_height = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Draw(trial % 2 == 0 ? 3 : 30);
    Run(&harness);
    const auto& out = harness.output<balance_torque_t>();
    if (out.status == balance_torque_t::STATUS_NOT_ACHIEVED) {
      EXPECT_GE(out.resultant_task.force[2], 0);
      continue;
    }
    ASSERT_EQ(out.status, balance_torque_t::STATUS_OK);
    ASSERT_EQ(out.region, balance_torque_t::REGION_POLYGON);
    const Dynamics dynamics(model_, now_, GetParam().in_contact);
    Eigen::VectorXd before_q, before, after_q, after;
    dynamics.Forward(ToEigen(task_.torque), &before_q, &before);
    dynamics.Forward(ToEigen(out.torque), &after_q, &after);
    const Eigen::Isometry3d frame = GetPose(out.frame_o);
    const Eigen::VectorXd task = Resultant(dynamics.data, before, frame);
    const Eigen::VectorXd balanced = Resultant(dynamics.data, after, frame);
    const Eigen::Vector2d cop_task(-task[4] / task[2], task[3] / task[2]);
    const Eigen::Vector2d cop(-balanced[4] / balanced[2], balanced[3] / balanced[2]);

    // Corners of the message: each is a sole's, and all of the soles' lie inside.
    std::vector<Eigen::Vector2d> corners;
    for (size_t i = 0; i < static_cast<size_t>(out.num_corners); ++i) {
      corners.push_back({out.corner_x[i], out.corner_y[i]});
    }
    ASSERT_GE(corners.size(), 4u);
    std::vector<Eigen::Vector2d> soles;
    for (size_t i = 0; i < 2; ++i) {
      if (!GetParam().in_contact[i]) continue;
      const robot::FootModel& foot = model_.feet()[i];
      for (const int corner : {0, 1, 2, 3}) {
        const Eigen::Vector3d at((corner % 2 == 0 ? -1 : 1) * (0.5 * foot.length - kMargin),
                                 (corner < 2 ? -1 : 1) * (0.5 * foot.width - side), 0);
        const Eigen::Vector3d in_o =
            frame.linear().transpose() * (dynamics.data.foot_pose[i] * at - frame.translation());
        soles.push_back(in_o.head<2>());
      }
    }
    for (const Eigen::Vector2d& corner : corners) {
      double nearest = 1;
      for (const auto& sole : soles) nearest = std::min(nearest, (sole - corner).norm());
      worst_corner = std::max(worst_corner, nearest);
    }
    // Nearest by brute force: no point of the boundary is nearer, and none when it is inside.
    double distance = std::numeric_limits<double>::infinity();
    bool inside = true;
    for (size_t i = 0; i < corners.size(); ++i) {
      const Eigen::Vector2d &a = corners[i], b = corners[(i + 1) % corners.size()];
      const Eigen::Vector2d edge = b - a, normal(-edge.y(), edge.x());
      for (const auto& sole : soles) EXPECT_GT(normal.dot(sole - a), -1e-12);
      inside = inside && normal.dot(cop_task - a) >= 0;
      const double along = std::clamp(edge.dot(cop_task - a) / edge.squaredNorm(), 0.0, 1.0);
      distance = std::min(distance, (a + along * edge - cop_task).norm());
    }
    if (inside) distance = 0;
    active += inside ? 0 : 1;
    worst_cop = std::max(worst_cop, std::abs((cop - cop_task).norm() - distance));
    EXPECT_EQ(ToEigen(out.balance_torque).norm() > 0, !inside);
    EXPECT_EQ(out.active_x != 0 || out.active_y != 0, !inside);
    worst_height =
        std::max(worst_height, std::abs((dynamics.data.com_jacobian * (after_q - before_q))[2]));
  }
  EXPECT_GT(active, 10);
  EXPECT_LT(worst_cop, 1e-9);
  EXPECT_LT(worst_corner, 1e-12);
  EXPECT_LT(worst_height, 1e-8);
}

TEST_P(MonitorCase, OnlyWatchesWhenBalancingIsOff) {
  Harness<ContactWrenchMonitor> harness(&context_, MonitorConfig(false));
  int outside = 0;
  for (int trial = 0; trial < 50; ++trial) {
    Draw(15);
    Run(&harness);
    const auto& out = harness.output<balance_torque_t>();
    ASSERT_EQ(out.status, balance_torque_t::STATUS_OK);
    EXPECT_EQ(out.torque, task_.torque);
    EXPECT_EQ(out.cop[0], out.cop_task[0]);
    EXPECT_EQ(out.cop[1], out.cop_task[1]);
    EXPECT_EQ(out.active_x, 0);
    EXPECT_EQ(out.active_y, 0);
    outside += std::abs(out.cop[1]) > out.cop_limit[1] ? 1 : 0;
    if (std::abs(out.cop[1]) > out.cop_limit[1] && out.resultant.force[2] < 0) {
      EXPECT_LT(out.resultant_margins.roll, 0);
    }
  }
  EXPECT_GT(outside, 0);
}

TEST_P(MonitorCase, PassesAHeldTorqueOnAndSaysSo) {
  Harness<ContactWrenchMonitor> harness(&context_, MonitorConfig(true));
  Draw(15);
  Run(&harness);
  ASSERT_EQ(harness.output<balance_torque_t>().status, balance_torque_t::STATUS_OK);
  const auto expect = [&](int8_t status) {
    Run(&harness);
    const auto& out = harness.output<balance_torque_t>();
    EXPECT_EQ(out.status, status);
    EXPECT_EQ(out.torque, task_.torque);
    EXPECT_EQ(ToEigen(out.balance_torque).norm(), 0);
    EXPECT_TRUE(MessageTraits<balance_torque_t>::AllFinite(out));
  };
  for (const int8_t status :
       {task_torque_t::STATUS_SINGULAR, task_torque_t::STATUS_INVALID_STATE}) {
    task_.status = status;
    expect(balance_torque_t::STATUS_HELD);
  }
  task_.status = task_torque_t::STATUS_OK;
  Run(&harness);
  EXPECT_EQ(harness.output<balance_torque_t>().status, balance_torque_t::STATUS_OK);
  state_.joint_position[0] = std::numeric_limits<double>::quiet_NaN();
  expect(balance_torque_t::STATUS_INVALID_STATE);
}

INSTANTIATE_TEST_SUITE_P(All, MonitorCase,
                         testing::Values(Case{TestRobot::kDyros, {true, true}, "DyrosDouble"},
                                         Case{TestRobot::kDyros, {true, false}, "DyrosRight"},
                                         Case{TestRobot::kDyros, {false, true}, "DyrosLeft"},
                                         Case{TestRobot::kMantis, {true, true}, "MantisDouble"},
                                         Case{TestRobot::kMantis, {false, true}, "MantisLeft"}),
                         [](const auto& info) { return std::string(info.param.name); });

// The stage that prepares works with the contacts of the tick before; a change must not leave a
// trace of them.
// Whatever the distance between the feet, each sole's centre is as far inside.
TEST(ContactWrenchMonitor, HalfWidthBeyondTheSolesFollowsTheirDistance) {
  const auto model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<ContactWrenchMonitor> harness(
      &context,
      "double_support { half_length: 0.12 } half_width_beyond_soles: 0.02 "
      "single_support { half_length: 0.12 half_width: 0.06 }");
  task_torque_t task{};
  MessageTraits<task_torque_t>::Resize(task, std::array{model.num_joints()});
  support_plan_t plan{};
  MessageTraits<support_plan_t>::Resize(plan, std::array{2});
  plan.in_contact = {1, 1};
  robot::RobotState state = StandingState(model);
  for (const double spread : {0.0, 0.1, 0.2}) {
    for (const char* joint : {"right_hip_roll", "left_hip_roll"}) {
      state.joint_position[model.FindJoint(joint)] += joint[0] == 'r' ? -spread : spread;
    }
    robot_state_t message = StateMessage(model, state);
    harness.Bind("robot_state", &message);
    harness.Bind("support_plan", &plan);
    harness.Bind("task_torque", &task);
    harness.Run(TickAt(0));
    robot::RobotData data(model);
    robot::ComputeKinematics(model, state, &data);
    robot::ComputeFeet(model, &data);
    const double distance =
        (data.foot_pose[0].translation() - data.foot_pose[1].translation()).norm();
    EXPECT_NEAR(harness.output<balance_torque_t>().cop_limit[1], 0.5 * distance + 0.02, 1e-9);
  }
}

TEST(ContactWrenchMonitor, AChangeOfSupportGivesWhatAFreshMonitorGives) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  std::mt19937 random(TestSeed(22));
  const robot::RobotState standing = StandingState(model);
  robot_state_t state = StateMessage(model, Disturbed(standing, 0.05, 0.3, &random));
  task_torque_t task{};
  MessageTraits<task_torque_t>::Resize(task, std::array{model.num_joints()});
  task.torque.assign(task.torque.size(), 5.0);
  support_plan_t plan{};
  MessageTraits<support_plan_t>::Resize(plan, std::array{2});
  plan.in_contact = {1, 1};
  ControlContext context(TestRobot::kDyros), other_context(TestRobot::kDyros);
  Harness<ContactWrenchMonitor> changing(&context, MonitorConfig(true));
  Harness<ContactWrenchMonitor> fresh(&other_context, MonitorConfig(true));
  for (auto* harness : {&changing, &fresh}) {
    harness->Bind("robot_state", &state);
    harness->Bind("support_plan", &plan);
    harness->Bind("task_torque", &task);
  }
  changing.Run(TickAt(0));
  state = StateMessage(model, Disturbed(standing, 0.05, 0.3, &random));
  plan.in_contact = {1, 0};
  changing.Run(TickAt(1));
  fresh.Run(TickAt(1));
  const auto &a = changing.output<balance_torque_t>(), &b = fresh.output<balance_torque_t>();
  EXPECT_EQ(a.torque, b.torque);
  EXPECT_EQ(a.cop[1], b.cop[1]);
  EXPECT_EQ(a.in_contact, b.in_contact);
  EXPECT_EQ(GetWrench(a.foot_wrench[0]), GetWrench(b.foot_wrench[0]));
}

TEST(ContactWrenchMonitor, RefusesLimitsThatCannotBe) {
  ControlContext context(TestRobot::kDyros);
  const auto field_of = [&](const std::string& config) -> std::string {
    try {
      Harness<ContactWrenchMonitor> harness(&context, config);
    } catch (const ConfigError& error) {
      return error.field();
    }
    return "accepted";
  };
  const std::string single = "single_support { half_length: 0.1 half_width: 0.1 } ";
  EXPECT_EQ(field_of(single + "double_support { half_length: 0.1 } half_width_beyond_soles: -1"),
            "half_width_beyond_soles");
  EXPECT_EQ(field_of(single), "accepted");  // from the soles
  EXPECT_EQ(field_of("region: POLYGON"), "accepted");
  EXPECT_EQ(field_of("region: POLYGON sole_margin: 0.075"), "sole_margin");
  EXPECT_EQ(field_of("region: POLYGON sole_margin: -0.01"), "sole_margin");
  EXPECT_EQ(field_of("region: POLYGON side_margin: 0.075"), "side_margin");
  EXPECT_EQ(field_of("region: POLYGON side_margin: nan"), "side_margin");
  EXPECT_EQ(field_of("region: POLYGON half_width_beyond_soles: 0.02"), "half_width_beyond_soles");
  EXPECT_EQ(field_of("region: POLYGON double_support { friction: -1 }"), "double_support.friction");
  EXPECT_EQ(field_of(single + "double_support { half_length: 0.1 }"), "accepted");
  EXPECT_EQ(field_of(single + "double_support { half_width: -1 }"), "double_support.half_width");
  EXPECT_EQ(field_of(single + "double_support { half_length: -0.1 half_width: 0.1 }"),
            "double_support.half_length");
  EXPECT_EQ(field_of(single + "double_support { half_length: 0.1 half_width: nan }"),
            "double_support.half_width");
  EXPECT_EQ(field_of(single + "double_support { half_length: 0.1 half_width: 0.1 friction: 0 }"),
            "double_support.friction");
  EXPECT_EQ(field_of(single + "double_support { half_length: 0.1 half_width: 0.1 }"), "accepted");
}

}  // namespace
}  // namespace poise
