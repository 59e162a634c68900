// The step planner with a faked estimator: phases, landings, references and capture point of a
// robot.
#include "components/step_planner/step_planner.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "components/messages/conversions.h"
#include "components/messages/motion.h"
#include "tests/components/control_fixture.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using robot::TestRobot;

// Returns how far a point lies in the hull of others, m, negative outside, by brute force: a pair
// of points with all others on its left is an edge.
double DistanceInside(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& point) {
  double inside = std::numeric_limits<double>::infinity(), outside = inside;
  for (const Eigen::Vector2d& a : points) {
    for (const Eigen::Vector2d& b : points) {
      const Eigen::Vector2d edge = b - a;
      if (edge.norm() < 1e-9) continue;
      const Eigen::Vector2d left = Eigen::Vector2d(-edge.y(), edge.x()).normalized();
      const bool on_hull = std::all_of(points.begin(), points.end(), [&](const auto& other) {
        return left.dot(other - a) > -1e-9;
      });
      if (!on_hull) continue;
      const double along = std::clamp(edge.dot(point - a) / edge.squaredNorm(), 0.0, 1.0);
      inside = std::min(inside, left.dot(point - a));
      outside = std::min(outside, (a + along * edge - point).norm());
    }
  }
  return inside >= 0 ? inside : -outside;
}

struct Case {
  TestRobot robot;
  const char* support;
  Contacts in_contact;
};

class StepPlannerCase : public testing::TestWithParam<Case> {
 protected:
  std::string Phase(const std::string& more = "") const {
    return std::string("phase { support: ") + GetParam().support + " " + more + " }";
  }
  robot::RobotModel model_ = robot::LoadTestRobot(GetParam().robot);
  ControlContext context_{GetParam().robot};
  robot::RobotState standing_ = StandingState(model_);
  std::mt19937 random_{TestSeed(24)};
};

// The references hold where the robot was at the first tick, bit for bit; what it does later is
// told beside them.
TEST_P(StepPlannerCase, HoldsWhereTheRobotWasAtTheFirstTick) {
  const auto body = static_cast<size_t>(model_.body_task_body());
  for (int trial = 0; trial < 20; ++trial) {
    Harness<StepPlanner> harness(&context_, Phase());
    const robot::RobotState first = Disturbed(standing_, 0.05, 0.3, &random_);
    const robot::RobotState now = Disturbed(first, 0.05, 0.5, &random_);
    robot_state_t message = StateMessage(model_, first);
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(0));
    message = StateMessage(model_, now);
    harness.Run(TickAt(1));
    const auto& out = harness.output<support_plan_t>();
    const auto& status = harness.output<planner_status_t>();
    ASSERT_EQ(out.status, support_plan_t::STATUS_OK);
    const robot::RobotData start = robot::Evaluate(model_, first), d = robot::Evaluate(model_, now);
    EXPECT_LT((GetVector3(status.com_position) - d.com).norm(), 1e-12);
    EXPECT_LT((GetVector3(status.com_velocity) - d.com_velocity).norm(), 1e-12);
    const PointMotion com = GetMotion(out.com_reference);
    const RotationMotion turn = GetMotion(out.body_reference);
    EXPECT_LT((com.position - start.com).norm(), 1e-12);
    EXPECT_EQ(com.velocity.norm() + com.acceleration.norm(), 0);
    EXPECT_LT((turn.rotation - start.body_rotation[body]).norm(), 1e-12);
    EXPECT_EQ(turn.angular_velocity.norm() + turn.angular_acceleration.norm(), 0);
    EXPECT_EQ(status.phase, 0);
    EXPECT_EQ(status.began_by, planner_status_t::OUTCOME_NONE);
    EXPECT_NEAR(status.phase_time, 0.002, 1e-12);
    EXPECT_EQ(status.next_phase, -1);
    EXPECT_EQ(status.phase_left, -1);
    EXPECT_EQ(status.feet_owner, planner_status_t::OWNER_PHASES);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(out.in_contact[i] != 0, GetParam().in_contact[i]);
      EXPECT_EQ(status.next_in_contact[i], out.in_contact[i]);
      EXPECT_EQ(status.foot_state[i], GetParam().in_contact[i] ? planner_status_t::FOOT_SUPPORT
                                                               : planner_status_t::FOOT_SWING);
      EXPECT_LT((GetPose(status.foot_pose[i]).matrix() - d.foot_pose[i].matrix()).norm(), 1e-12);
      // A foot in contact goes nowhere.
      const Eigen::Isometry3d& sole = (GetParam().in_contact[i] ? d : start).foot_pose[i];
      EXPECT_LT((GetMotion(out.foot_reference[i]).position - sole.translation()).norm(), 1e-12);
      EXPECT_LT((GetMotion(out.foot_rotation_reference[i]).rotation - sole.linear()).norm(), 1e-12);
    }
  }
}

TEST_P(StepPlannerCase, WithoutTasksTheReferencesAreWhereTheRobotIs) {
  Harness<StepPlanner> harness(&context_, Phase("gravity_compensation: true"));
  for (int tick = 0; tick < 10; ++tick) {
    const robot::RobotState now = Disturbed(standing_, 0.05, 0.3, &random_);
    const robot_state_t message = StateMessage(model_, now);
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(tick));
    const auto& out = harness.output<support_plan_t>();
    EXPECT_EQ(out.gravity_compensation, 1);
    const robot::RobotData d = robot::Evaluate(model_, now);
    EXPECT_LT((GetMotion(out.com_reference).position - d.com).norm(), 1e-12);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_LT(
          (GetMotion(out.foot_rotation_reference[i]).rotation - d.foot_pose[i].linear()).norm(),
          1e-12);
    }
  }
}

// COM + velocity / ω, seen along the normal of the soles' plane, h above it along the vertical; on
// level soles these are one.
TEST_P(StepPlannerCase, TheCapturePointIsThePendulums) {
  Harness<StepPlanner> harness(&context_, Phase());
  for (int tick = 0; tick < 50; ++tick) {
    robot::RobotState now = standing_;
    std::uniform_real_distribution<double> speed(-0.5, 0.5);
    now.base_linear_velocity = {speed(random_), speed(random_), 0};  // all of it alike
    const robot_state_t message = StateMessage(model_, now);
    harness.Bind("robot_state", &message);
    harness.Run(TickAt(tick));
    const auto& out = harness.output<planner_status_t>();
    const robot::RobotData d = robot::Evaluate(model_, now);
    const double ground = d.foot_pose[0].translation().z();
    const double frequency = std::sqrt(robot::kGravity / (d.com.z() - ground));
    const Eigen::Vector2d point = (d.com + now.base_linear_velocity / frequency).head<2>();
    EXPECT_LT((GetVector3(out.capture_point).head<2>() - point).norm(), 1e-6);
    EXPECT_NEAR(out.capture_point[2], ground, 1e-6);
    std::vector<Eigen::Vector2d> corners;
    for (size_t i = 0; i < 2; ++i) {
      if (!GetParam().in_contact[i]) continue;
      const robot::FootModel& foot = model_.feet()[i];
      for (const int k : {0, 1, 2, 3}) {
        const Eigen::Vector3d corner(k % 2 == 0 ? -0.5 * foot.length : 0.5 * foot.length,
                                     k < 2 ? -0.5 * foot.width : 0.5 * foot.width, 0);
        corners.push_back((d.foot_pose[i] * corner).head<2>());
      }
    }
    const double margin = DistanceInside(corners, point);
    EXPECT_NEAR(out.capture_margin, margin, 1e-6);
  }
}

TEST_P(StepPlannerCase, SendsTheLastPlanAgainWhenTheStateIsUnusable) {
  Harness<StepPlanner> harness(&context_, Phase());
  robot_state_t message = StateMessage(model_, standing_);
  harness.Bind("robot_state", &message);
  harness.Run(TickAt(0));
  const support_plan_t good = harness.output<support_plan_t>();
  const planner_status_t reported = harness.output<planner_status_t>();
  const robot_state_t sound = message;
  message.base_position[2] = std::numeric_limits<double>::infinity();
  harness.Run(TickAt(1));
  const auto& out = harness.output<support_plan_t>();
  EXPECT_EQ(out.status, support_plan_t::STATUS_INVALID_STATE);
  EXPECT_EQ(GetVector3(out.com_reference.position), GetVector3(good.com_reference.position));
  EXPECT_TRUE(MessageTraits<support_plan_t>::AllFinite(out));
  const auto& status = harness.output<planner_status_t>();
  EXPECT_EQ(GetVector3(status.com_position), GetVector3(reported.com_position));
  EXPECT_TRUE(MessageTraits<planner_status_t>::AllFinite(status));
  message = sound;
  harness.Run(TickAt(2));
  EXPECT_EQ(out.status, support_plan_t::STATUS_OK);
}

INSTANTIATE_TEST_SUITE_P(All, StepPlannerCase,
                         testing::Values(Case{TestRobot::kDyros, "DOUBLE", {true, true}},
                                         Case{TestRobot::kDyros, "RIGHT", {true, false}},
                                         Case{TestRobot::kMantis, "DOUBLE", {true, true}},
                                         Case{TestRobot::kMantis, "LEFT", {false, true}}));

// A reference comes out of its message with the bits it had.
TEST(Motion, GoesOverTheBusUnchanged) {
  std::mt19937 random(TestSeed(25));
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 1000; ++trial) {
    PointMotion point;
    RotationMotion turn;
    for (auto* vector : {&point.position, &point.velocity, &point.acceleration,
                         &turn.angular_velocity, &turn.angular_acceleration}) {
      *vector = Eigen::Vector3d::NullaryExpr([&] { return normal(random); });
    }
    turn.rotation =
        Eigen::AngleAxisd(normal(random), point.velocity.normalized()).toRotationMatrix();
    point_motion_t point_message;
    rotation_motion_t turn_message;
    SetMotion(point, &point_message);
    SetMotion(turn, &turn_message);
    EXPECT_EQ(GetMotion(point_message).position, point.position);
    EXPECT_EQ(GetMotion(point_message).velocity, point.velocity);
    EXPECT_EQ(GetMotion(point_message).acceleration, point.acceleration);
    EXPECT_EQ(GetMotion(turn_message).rotation, turn.rotation);
    EXPECT_EQ(GetMotion(turn_message).angular_velocity, turn.angular_velocity);
    EXPECT_EQ(GetMotion(turn_message).angular_acceleration, turn.angular_acceleration);
    EXPECT_EQ(turn_message.rotation[1], turn.rotation(0, 1));  // row by row
  }
}

TEST(StepPlanner, ReportsAWaitingUnloading) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<StepPlanner> harness(
      &context,
      "phase { duration: 0.1 transition { kind: UNLOAD foot: LEFT_FOOT duration: 0.01 } } "
      "phase { support: RIGHT }");
  robot::RobotState state = StandingState(model);  // COM between the feet
  robot_state_t message = StateMessage(model, state);
  harness.Bind("robot_state", &message);
  for (int tick = 0; tick < 100; ++tick) {
    harness.Run(TickAt(tick));
    const auto& out = harness.output<support_plan_t>();
    ASSERT_EQ(out.status, support_plan_t::STATUS_WAITING);
    ASSERT_EQ(harness.output<planner_status_t>().phase, 0);
    ASSERT_EQ(out.transition, support_plan_t::TRANSITION_NONE);
    ASSERT_EQ(out.in_contact[1], 1);
  }
  // The whole robot leant about the soles' middle until the COM is over the right foot.
  state.base_position.y() -= 0.1;
  message = StateMessage(model, state);
  // Soles moved with it: still between the feet.
  harness.Run(TickAt(100));
  EXPECT_EQ(harness.output<support_plan_t>().status, support_plan_t::STATUS_WAITING);
  const Eigen::Quaterniond lean(Eigen::AngleAxisd(0.12, Eigen::Vector3d::UnitX()));
  state.base_position = lean * state.base_position;
  state.base_orientation = lean * state.base_orientation;
  message = StateMessage(model, state);
  const robot::RobotData data = robot::Evaluate(model, state);
  // Inside the sole (75 mm) is not enough: 25 mm less are its reduced rectangle.
  ASSERT_LT(std::abs(data.com.y() - data.foot_pose[0].translation().y()), 0.05);
  // On its way out: the point where it can be brought to rest lies 80 mm further.
  robot::RobotState moving = state;
  moving.base_linear_velocity.y() = 0.3;
  message = StateMessage(model, moving);
  harness.Run(TickAt(101));
  EXPECT_EQ(harness.output<support_plan_t>().status, support_plan_t::STATUS_WAITING);
  message = StateMessage(model, state);
  harness.Run(TickAt(102));
  EXPECT_EQ(harness.output<support_plan_t>().status, support_plan_t::STATUS_OK);
  EXPECT_EQ(harness.output<support_plan_t>().transition, support_plan_t::TRANSITION_UNLOADING);
  EXPECT_EQ(harness.output<support_plan_t>().transition_foot, 1);
}

// A robot on its right foot whose left one, lowered at 0.1 s, is to carry from 0.4 s on.
class TouchDown : public testing::Test {
 protected:
  TouchDown()
      : harness_(&context_,
                 "phase { duration: 0.1 support: RIGHT } "
                 "phase { duration: 0.3 support: RIGHT foot { foot: LEFT_FOOT z: -0.02 "
                 "duration: 0.1 } } "
                 "phase { transition { kind: LOAD foot: LEFT_FOOT duration: 0.1 } }") {
    message_ = StateMessage(robot::LoadTestRobot(TestRobot::kDyros),
                            StandingState(robot::LoadTestRobot(TestRobot::kDyros)));
    message_.foot_wrench[0].force[2] = -500;
    harness_.Bind("robot_state", &message_);
  }
  /// `load` on the left sole, N, until `time`, s.
  const planner_status_t& Run(double time, double load) {
    message_.foot_wrench[1].force[2] = -load;
    while (TickAt(tick_).time < time - 1e-9) harness_.Run(TickAt(tick_++));
    return harness_.output<planner_status_t>();
  }
  const support_plan_t& plan() const { return harness_.output<support_plan_t>(); }

  ControlContext context_{TestRobot::kDyros};
  Harness<StepPlanner> harness_;
  robot_state_t message_;
  int64_t tick_ = 0;
};

TEST_F(TouchDown, InTimeDoesNotShiftTheSchedule) {
  EXPECT_EQ(Run(0.07, 0).foot_state[1], planner_status_t::FOOT_SWING);
  EXPECT_EQ(Run(0.4, 12).foot_state[1], planner_status_t::FOOT_TOUCHING);
  EXPECT_EQ(plan().in_contact[1], 0);
  const planner_status_t& out = Run(0.402, 12);
  EXPECT_EQ(plan().status, support_plan_t::STATUS_OK);
  EXPECT_EQ(out.phase, 2);
  EXPECT_EQ(plan().in_contact[1], 1);
  EXPECT_EQ(out.foot_state[1], planner_status_t::FOOT_SUPPORT);
  EXPECT_EQ(plan().transition, support_plan_t::TRANSITION_LOADING);
  EXPECT_NEAR(plan().transition_progress, 0, 1e-8);
}

TEST_F(TouchDown, LateHoldsTheScheduleUntilTheLoadHasLasted) {
  EXPECT_EQ(Run(0.2, 0).foot_state[1], planner_status_t::FOOT_SWING);
  EXPECT_EQ(Run(0.21, 0).foot_state[1], planner_status_t::FOOT_SEARCHING);
  const planner_status_t& out = Run(0.4, 0);
  EXPECT_EQ(plan().status, support_plan_t::STATUS_OK);
  EXPECT_EQ(out.next_phase, 2);
  EXPECT_NEAR(out.phase_left, 0.4 - TickAt(tick_ - 1).time, 1e-9);
  Run(0.5, 0);
  EXPECT_EQ(out.phase_left, 0);
  EXPECT_EQ(plan().status, support_plan_t::STATUS_WAITING);
  EXPECT_EQ(out.waiting_for, planner_status_t::WAITING_CONTACT);
  EXPECT_EQ(out.phase, 1);
  EXPECT_LT(plan().foot_reference[1].position[2], out.foot_pose[1].position[2] - 0.02);
  // 0.02 s of load, then 0.3 s in which it settles.
  EXPECT_EQ(Run(0.52, 12).foot_state[1], planner_status_t::FOOT_SEARCHING);
  EXPECT_EQ(Run(0.522, 12).foot_state[1], planner_status_t::FOOT_TOUCHING);
  EXPECT_EQ(Run(0.82, 12).waiting_for, planner_status_t::WAITING_CONTACT);
  EXPECT_EQ(Run(0.824, 12).phase, 2);
  EXPECT_EQ(plan().status, support_plan_t::STATUS_OK);
  EXPECT_EQ(out.waiting_for, planner_status_t::WAITING_NONE);
}

// This foot does not move: its reference gives up at twice the depth.
TEST_F(TouchDown, WithoutASurfaceItEndsInSingleSupport) {
  const planner_status_t& out = Run(8, 0);
  EXPECT_EQ(plan().status, support_plan_t::STATUS_WAITING);
  EXPECT_EQ(out.waiting_for, planner_status_t::WAITING_NO_SURFACE);
  EXPECT_EQ(out.foot_state[1], planner_status_t::FOOT_RETRACTED);
  EXPECT_EQ(out.phase, 1);
  EXPECT_NEAR(plan().foot_reference[1].position[2], -0.02 - 0.12 + 0.05, 1e-3);
  EXPECT_EQ(Run(9, 100).phase, 1);  // for good
}

TEST_F(TouchDown, ALoadThatIsNoNumberIsAnInvalidState) {
  Run(0.1, 0);
  Run(0.11, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(plan().status, support_plan_t::STATUS_INVALID_STATE);
  Run(0.12, 0);
  EXPECT_EQ(plan().status, support_plan_t::STATUS_OK);
}

constexpr double kSlip = 0.008;  // m: so little that the COM's reference does not wait

// The COM's reference after 1500 ticks, when the robot has slipped ahead by kSlip in tick `slip`;
// m, from where the COM was at the start.
PointMotion ComAfterSlip(const std::string& config, int64_t slip) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<StepPlanner> harness(&context, config);
  robot_state_t message{};
  harness.Bind("robot_state", &message);
  robot::RobotState state = StandingState(model);
  const Eigen::Vector3d start = robot::Evaluate(model, state).com;
  for (int64_t tick = 0; tick < 1500; ++tick) {
    if (tick == slip) state.base_position.x() += kSlip;
    message = StateMessage(model, state);
    message.foot_load_share[0] = message.foot_load_share[1] = 0.5;
    message.foot_wrench[0].force[2] = message.foot_wrench[1].force[2] = -250;
    harness.Run(TickAt(tick));
  }
  EXPECT_EQ(harness.output<planner_status_t>().phase, 1);
  PointMotion com = GetMotion(harness.output<support_plan_t>().com_reference);
  com.position -= start;
  return com;
}

// Soles slip while the COM's reference moves, which goes after them once it rests. A phase may
// begin before that, or in its midst: above the soles it is once, and relative to where it was
// likewise.
TEST(StepPlanner, APhaseThatBeginsWhereSolesHaveSlippedIsNotBesideThem) {
  for (const char* target : {"OVER_MIDDLE", "HOLD"}) {
    for (const char* moves : {"1", "0.8", "0.5"}) {
      const PointMotion com =
          ComAfterSlip(fmt::format("phase {{ support: DOUBLE duration: 1 "
                                   "com {{ target: SHIFT y: 0.01 duration: {} }} }} "
                                   "phase {{ support: DOUBLE com {{ target: {} duration: 0.5 }} }}",
                                   moves, target),
                       200);
      EXPECT_NEAR(com.position.x(), kSlip, 1e-6) << target << ' ' << moves;
      EXPECT_EQ(com.velocity.norm(), 0) << target << ' ' << moves;
    }
  }
}

// The ground below a foot that a phase put down may give way: its sole sinks and rolls, and a COM
// that went after it would load it the more.
TEST(StepPlanner, ASoleThatAPhasePutDownIsNotFollowed) {
  for (const bool lifted : {false, true}) {
    const PointMotion com = ComAfterSlip(
        fmt::format("phase {{ support: {} duration: 0.5 }} phase {{ support: DOUBLE }}",
                    lifted ? "RIGHT" : "DOUBLE"),
        500);
    EXPECT_NEAR(com.position.x(), lifted ? 0 : kSlip, 1e-6) << lifted;
  }
}

// Pushed off the foot that it walks on, the robot makes recovery steps: its body goes on heading
// where the walk has turned it, rather than back to where it headed before.
TEST(StepPlanner, ARecoveryThatTakesAWalkOverKeepsItsHeading) {
  const robot::RobotModel model = robot::LoadTestRobot(TestRobot::kDyros);
  ControlContext context(TestRobot::kDyros);
  Harness<StepPlanner> harness(&context,
                               "phase { support: DOUBLE } recovery { enabled: true } "
                               "walk { enabled: true quasi_static: true command { vx: 0 } }");
  robot_state_t message{};
  harness.Bind("robot_state", &message);
  const auto& plan = harness.output<support_plan_t>();
  const auto& status = harness.output<planner_status_t>();
  const auto reference = [&] { return GetMotion(plan.body_reference).rotation; };
  // All of it has turned since the walk began, as its steps would have turned it.
  constexpr double kTurn = 0.3;  // rad
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(kTurn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const robot::RobotState standing = StandingState(model);
  robot::RobotState turned = standing;
  turned.base_position = turn * standing.base_position;
  turned.base_orientation = Eigen::Quaterniond(turn) * standing.base_orientation;
  const robot::RobotData data = robot::Evaluate(model, turned);
  const double frequency = std::sqrt(robot::kGravity / data.com.z());
  int64_t tick = 0, recovering = 0;
  double largest_turn = 0;
  for (Eigen::Matrix3d last; recovering < 100 && tick < 2000; last = reference()) {
    robot::RobotState state = tick < 10 ? standing : turned;
    // The capture point: above the foot that stays, then 0.17 m ahead of it.
    Eigen::Vector3d point = data.foot_pose[1].translation();
    if (plan.in_contact[0] == 0 || recovering > 0) point += turn * Eigen::Vector3d(0.17, 0, 0);
    if (tick >= 10) {
      state.base_linear_velocity.head<2>() += frequency * (point - data.com).head<2>();
    }
    message = StateMessage(model, state);
    harness.Run(TickAt(tick));
    ASSERT_EQ(plan.status, support_plan_t::STATUS_OK);
    if (tick > 0) {
      const double step = Eigen::AngleAxisd(reference() * last.transpose()).angle();
      largest_turn = std::max(largest_turn, step);
    }
    const bool steps = status.stepping != planner_status_t::STEPPING_NONE;
    ASSERT_EQ(plan.com_follows == support_plan_t::FOLLOWS_COP, steps);
    const bool recovers = steps && status.step_reason != planner_status_t::REASON_WALK;
    ASSERT_EQ(status.feet_owner, recovers ? planner_status_t::OWNER_RECOVERY
                                 : steps  ? planner_status_t::OWNER_WALK
                                          : planner_status_t::OWNER_PHASES);
    if (recovers) ++recovering;
    ++tick;
  }
  EXPECT_EQ(recovering, 100);
  // At 5 1/s, critically damped: 0.3 rad turn with at most 5/e of it a second.
  EXPECT_LT(largest_turn, 1.1 * kTurn * 5 / std::exp(1) * 0.002);
  EXPECT_LT(Eigen::AngleAxisd(reference() * turn.transpose()).angle(), 0.15);
}

// What follows when there is no surface, and when a foot that carries does not.
class WayOut : public testing::Test {
 protected:
  WayOut() {
    message_ = StateMessage(robot::LoadTestRobot(TestRobot::kDyros),
                            StandingState(robot::LoadTestRobot(TestRobot::kDyros)));
    message_.foot_wrench[0].force[2] = -500;
    harness_.Bind("robot_state", &message_);
  }
  /// `load` on the left sole, N, until `phase` begins; its time, s; 20 s when it does not.
  double RunUntil(int phase, double load) {
    message_.foot_wrench[1].force[2] = -load;
    do {
      harness_.Run(TickAt(tick_++));
    } while (status().phase != phase && TickAt(tick_).time < 20);
    return TickAt(tick_ - 1).time;
  }
  const support_plan_t& plan() const { return harness_.output<support_plan_t>(); }
  const planner_status_t& status() const { return harness_.output<planner_status_t>(); }
  double foot_height() const { return plan().foot_reference[1].position[2]; }

  ControlContext context_{TestRobot::kDyros};
  Harness<StepPlanner> harness_{&context_, R"(
    phase { name: "up" duration: 0.1 support: RIGHT }
    phase { name: "down" duration: 0.3 support: RIGHT
            foot { foot: LEFT_FOOT z: -0.02 duration: 0.1 }
            next { on: NO_SURFACE to: "higher" } }
    phase { name: "stand" next { on: CONTACT_LOST foot: LEFT_FOOT to: "right" } }
    phase { name: "higher" duration: 1 support: RIGHT
            foot { foot: LEFT_FOOT z: 0.03 duration: 0.5 } next { to: "down" } }
    phase { name: "right" support: RIGHT }
  )"};
  robot_state_t message_;
  int64_t tick_ = 0;
};

TEST_F(WayOut, AFootWithoutASurfaceComesUpAndThePlanGoesOnFromThere) {
  EXPECT_NEAR(RunUntil(1, 0), 0.1, 1e-9);
  EXPECT_EQ(status().next_in_contact[1], 1);
  double lowest = 0, last = foot_height();
  int retracted = 0, waiting = 0;
  while (status().phase == 1) {
    harness_.Run(TickAt(tick_++));
    lowest = std::min(lowest, foot_height());
    EXPECT_LT(std::abs(foot_height() - last), 1e-3);  // no step
    last = foot_height();
    retracted += status().foot_state[1] == planner_status_t::FOOT_RETRACTED;
    waiting += status().waiting_for == planner_status_t::WAITING_NO_SURFACE;
  }
  // This foot does not follow: its reference gives up at twice the depth, is brought to a stand
  // within millimetres, and rises by 0.05 m from there.
  EXPECT_NEAR(lowest, -0.02 - 0.12, 0.01);
  EXPECT_NEAR(foot_height(), -0.02 - 0.12 + 0.05, 1e-3);
  EXPECT_NEAR(retracted * 0.002, 0.05 / 0.03, 0.01);
  EXPECT_GT(waiting, 0);
  EXPECT_EQ(status().phase, 3);
  EXPECT_EQ(status().began_by, planner_status_t::OUTCOME_NO_SURFACE);
  EXPECT_EQ(status().waiting_for, planner_status_t::WAITING_NONE);
  EXPECT_EQ(status().foot_state[1], planner_status_t::FOOT_SWING);
  EXPECT_EQ(plan().in_contact[1], 0);
  // "higher", from where the foot is held, then down again, and there a load.
  const double begun = TickAt(tick_ - 1).time, held = foot_height();
  EXPECT_NEAR(RunUntil(1, 0), begun + 1, 1e-9);
  EXPECT_NEAR(foot_height(), held + 0.03, 1e-6);
  EXPECT_EQ(status().began_by, planner_status_t::OUTCOME_DONE);
  RunUntil(2, 50);
  EXPECT_EQ(plan().in_contact[1], 1);
  EXPECT_EQ(status().foot_state[1], planner_status_t::FOOT_SUPPORT);
}

TEST_F(WayOut, ALostContactIsGivenUp) {
  RunUntil(1, 0);
  const double stood = RunUntil(2, 50);
  EXPECT_LT(stood, 1);
  message_.foot_wrench[1].force[2] = -300;
  for (int i = 0; i < 100; ++i) harness_.Run(TickAt(tick_++));
  EXPECT_EQ(status().phase, 2);
  const double lost = TickAt(tick_).time;
  EXPECT_NEAR(RunUntil(4, 0), lost + 0.1, 1e-9);
  EXPECT_EQ(status().began_by, planner_status_t::OUTCOME_CONTACT_LOST);
  EXPECT_EQ(plan().in_contact[0], 1);
  EXPECT_EQ(plan().in_contact[1], 0);
  // It hangs where it was when it was given up.
  const Eigen::Vector3d sole = GetVector3(status().foot_pose[1].position);
  EXPECT_LT((GetVector3(plan().foot_reference[1].position) - sole).norm(), 1e-12);
}

}  // namespace
}  // namespace poise
