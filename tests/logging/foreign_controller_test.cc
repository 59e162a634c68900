// Runs of controllers that are not Poise's: what their log does not say is not known, and what the
// truth says is judged by the truth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "logging/metrics/metric_needs.h"
#include "logging/metrics/metrics.h"
#include "logging/metrics/true_contacts.h"
#include "logging/metrics/walk_course.h"
#include "operate/act_t.hpp"
#include "tests/logging/record_fixture.h"

namespace poise::logging {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kWeight = 1000;  // N, on a foot that carries: more than enough for any robot

class ForeignControllerTest : public RecordTest {
 protected:
  ForeignControllerTest() {
    without_ = {"SUPPORT_PLAN", "PLANNER_STATUS", "TASK_TORQUE", "BALANCE_TORQUE"};
  }

  /// A command of torques or impedance alone.
  void SayNothing() {
    for (joint_command_t& command : command_) {
      command.eta_feasible = 0;
      for (size_t foot = 0; foot < 2; ++foot) {
        command.in_contact[foot] = command.conditions_met[foot] = 0;
        command.margins[foot] = {};
      }
    }
  }
  /// Ticks of 20 ms; both feet carry, but for five swings of 0.2 s, the left foot's first.
  void Walk(double velocity) {
    spec_.set_tick_period(0.02);
    for (size_t t = 0; t < kTicks; ++t) {
      truth_[t].com_position[0] = velocity * 0.02 * static_cast<double>(t);
      truth_[t].com_position[2] = 0.7;
      for (wrench_t& wrench : truth_[t].foot_wrench) wrench.force[2] = -kWeight;
    }
    for (size_t step = 0; step < 5; ++step) {
      for (size_t t = 10 + 15 * step; t < 20 + 15 * step; ++t) {
        truth_[t].foot_wrench[1 - step % 2].force[2] = 0;
      }
      for (size_t t = 20 + 15 * step; t < kTicks; ++t) {
        truth_[t].foot_pose[1 - step % 2].position[0] = truth_[20 + 15 * step].com_position[0];
      }
    }
  }
  std::vector<std::string> Missing(const std::string& name) {
    return MissingFor(*FindMetric(name), Read());
  }
};

TEST_F(ForeignControllerTest, ConditionsAreTheCommandsOwn) {
  EXPECT_EQ(Measure("violated_ticks"), 0);
  command_[10].margins[1].roll = -0.001;
  command_[20].conditions_met[0] = 0;
  EXPECT_EQ(Measure("violated_ticks"), 2);
  EXPECT_THAT(Missing("violated_ticks"), IsEmpty());
}

TEST_F(ForeignControllerTest, WhatACommandLeavesZeroIsNotKnown) {
  SayNothing();
  for (const char* name : {"violated_ticks", "eta_infeasible_ticks", "eta_lowest", "eta_span",
                           "left_foot_roll_margin", "right_foot_load_computed_max", "cop_max_y",
                           "foot_force_error_rms", "torque_step_at_switch"}) {
    EXPECT_TRUE(Unanswered(name)) << name;
    EXPECT_FALSE(Missing(name).empty()) << name;
  }
  EXPECT_THAT(Missing("violated_ticks"), ElementsAre("JOINT_COMMAND.conditions_met, margins"));
  EXPECT_THAT(Missing("com_error_end"), ElementsAre("SUPPORT_PLAN.com_reference"));
  EXPECT_THAT(Missing("joint_torque_share"), IsEmpty());
  without_.insert({"GROUND_TRUTH", "BRIDGE_STATUS", "JOINT_COMMAND"});
  EXPECT_THAT(
      Missing("joint_torque_share"),
      ElementsAre(
          "GROUND_TRUTH.joint_torque or BRIDGE_STATUS.applied_torque or JOINT_COMMAND.torque"));
}

TEST_F(ForeignControllerTest, WhatNeverHappenedIsKnown) {
  without_.clear();
  EXPECT_TRUE(Unanswered("balancing_first"));
  EXPECT_THAT(Missing("balancing_first"), IsEmpty());
}

TEST_F(ForeignControllerTest, ARatioThatIsToldToBeInfeasibleIsKnown) {
  for (joint_command_t& command : command_) {
    command.eta_feasible = 0;
    command.eta_max = 1;  // what an infeasible ratio says
  }
  EXPECT_EQ(Measure("eta_infeasible_ticks"), kTicks);
}

// A quarter of the load on the right foot, 0.105 m to the right, and the rest on the left one.
TEST_F(ForeignControllerTest, CentresOfPressureOfSensorsAndCommandAlone) {
  for (size_t t = 0; t < kTicks; ++t) {
    for (size_t foot = 0; foot < 2; ++foot) {
      truth_[t].foot_pose[foot] = planner_[t].foot_pose[foot];
      const double load = foot == 0 ? 100 : 300;
      sensors_[t].foot_wrench[foot].force[2] = -load;
      command_[t].foot_wrench[foot].force[2] = foot == 0 ? -300 : -100;
      command_[t].foot_wrench[foot].moment[1] = foot == 0 ? 300 * 0.02 : 100 * 0.02;
    }
  }
  EXPECT_NEAR(Measure("cop_measured_max_y"), 52.5, 1e-9);
  EXPECT_NEAR(Measure("cop_measured_max_x"), 0, 1e-9);
  EXPECT_NEAR(Measure("cop_max_y"), 52.5, 1e-9);
  EXPECT_NEAR(Measure("cop_max_x"), 20, 1e-9);
  // One foot in the air: of the other alone.
  for (size_t t = 0; t < kTicks; ++t) sensors_[t].foot_wrench[0].force[2] = 0;
  EXPECT_NEAR(Measure("cop_measured_max_y"), 0, 1e-9);
}

TEST_F(ForeignControllerTest, StepsWayAndCostAreTheTruths) {
  Walk(0.5);
  for (ground_truth_t& truth : truth_) {
    truth.joint_torque[3] = -10;
    truth.joint_velocity[3] = -1;
    truth.joint_torque[4] = 5;
    truth.joint_velocity[4] = -1;  // takes energy up
  }
  EXPECT_EQ(Measure("steps"), 5);
  // From the first landing to the third, and to the fifth: 0.3 m in 0.6 s each.
  EXPECT_NEAR(Measure("walk_way"), 0.6, 1e-9);
  EXPECT_NEAR(Measure("walk_speed_max"), 0.5, 1e-9);
  const double weight = Read().robot.total_mass() * robot::kGravity;
  EXPECT_NEAR(Measure("walk_cost_of_transport"), 10 * 1.2 / (weight * 0.6), 1e-9);
  EXPECT_TRUE(Unanswered("walk_velocity_error_rms"));
  EXPECT_THAT(Missing("walk_velocity_error_rms"),
              ElementsAre("PLANNER_STATUS.walk_velocity, step_reason"));
}

// A planner that stands while the robot walks is not believed, and one that walks while it stands
// neither.
TEST_F(ForeignControllerTest, APlanThatNobodyFollowsChangesNoStep) {
  without_ = {"TASK_TORQUE", "BALANCE_TORQUE"};
  Walk(0.5);
  EXPECT_EQ(Measure("steps"), 5);
  EXPECT_TRUE(Unanswered("walk_velocity_error_rms"));
  Walk(0);
  for (ground_truth_t& truth : truth_) {
    for (wrench_t& wrench : truth.foot_wrench) wrench.force[2] = -kWeight;
  }
  for (size_t t = 50; t < kTicks; ++t) {
    planner_[t].num_steps = 3;
    planner_[t].step_reason = planner_status_t::REASON_WALK;
  }
  EXPECT_EQ(Measure("steps"), 0);
  EXPECT_TRUE(Unanswered("walk_way"));
}

// Without a planner it stands between two walks of a step each.
TEST_F(ForeignControllerTest, ASlowWalkIsOneWhereThePlannerWalksOn) {
  Walk(0.5);
  spec_.set_tick_period(0.3);  // 1.5 s on both feet between two swings
  EXPECT_TRUE(Unanswered("walk_way"));
  without_ = {"TASK_TORQUE", "BALANCE_TORQUE"};
  EXPECT_TRUE(Unanswered("walk_way"));
  for (planner_status_t& planner : planner_) {
    planner.stepping = planner_status_t::STEPPING_UNLOADING;
    planner.step_reason = planner_status_t::REASON_WALK;
  }
  EXPECT_NEAR(Measure("walk_way"), 0.6, 1e-9);
}

TEST_F(ForeignControllerTest, ARattlingFootMakesNoStep) {
  Walk(0);
  for (ground_truth_t& truth : truth_) {
    for (wrench_t& wrench : truth.foot_wrench) wrench.force[2] = -kWeight;
  }
  for (size_t t = 30; t < 34; ++t) truth_[t].foot_wrench[0].force[2] = 0;  // 0.08 s
  EXPECT_EQ(Measure("steps"), 0);
  ASSERT_EQ(TrueSupports(Read()).size(), 1u);
  for (size_t t = 34; t < 50; ++t) truth_[t].foot_wrench[0].force[2] = t == 40 ? -kWeight : 0;
  ASSERT_EQ(TrueSupports(Read()).size(), 3u) << "a sole that scrapes for 20 ms is on its way still";
  EXPECT_EQ(Measure("steps"), 0) << "it comes down where it stood";
  for (size_t t = 50; t < kTicks; ++t) truth_[t].foot_pose[0].position[0] = 0.06;
  EXPECT_EQ(Measure("steps"), 1);
}

// On soft ground a sole that has come down comes off once more while it is loaded.
TEST_F(ForeignControllerTest, AHopOfTheFootThatSteppedIsNoStep) {
  Walk(0.5);
  spec_.set_tick_period(0.04);
  const double way = Measure("walk_way");
  for (size_t t = 22; t < 25; ++t) truth_[t].foot_wrench[1].force[2] = 0;  // 0.12 s
  EXPECT_EQ(Measure("steps"), 5);
  EXPECT_EQ(Measure("walk_way"), way);
  for (size_t t = 25; t < kTicks; ++t) truth_[t].foot_pose[1].position[0] += 0.06;
  EXPECT_EQ(Measure("steps"), 6) << "it comes down elsewhere";
}

// A robot that a push rocks from foot to foot, and one that steps on the spot.
TEST_F(ForeignControllerTest, StepsOnTheSpotAreTakenInTurn) {
  Walk(0);
  const double steps = Measure("steps");
  ASSERT_GE(steps, 3);
  for (size_t t = 0; t < kTicks; ++t) {
    for (wrench_t& wrench : truth_[t].foot_wrench) wrench.force[2] = -kWeight;
    if (t >= 30 && t < 40) truth_[t].foot_wrench[0].force[2] = 0;
    if (t >= 42 && t < 50) truth_[t].foot_wrench[1].force[2] = 0;
  }
  EXPECT_EQ(TrueSupports(Read()).size(), 5u);
  EXPECT_EQ(Measure("steps"), 0);
}

// Ahead from 0.4 s on, a turn from 1.2 s on, and a stop once the fifth step has begun, at 1.4 s.
TEST_F(ForeignControllerTest, AWalkIsHeldAgainstItsCommandedCourse) {
  EXPECT_THAT(Missing("walk_course_share"), ElementsAre("a way that step_planner.walk commands"));
  ComponentConfig* const planner = spec_.add_config();
  planner->set_component("step_planner");
  planner->set_text(
      "walk { enabled: true command { time: 0.4 vx: 0.5 } command { time: 1.2 wz: 0.5 }\n"
      "  command { after_steps: 5 stop: true } }");
  const auto turn = [&](double rate) {
    for (size_t t = 0; t < kTicks; ++t) {
      const double angle = rate * std::max(0.0, 0.02 * static_cast<double>(t) - 1.2);
      truth_[t].base_orientation[0] = std::cos(angle / 2);
      truth_[t].base_orientation[3] = std::sin(angle / 2);
    }
  };
  Walk(0.5);
  turn(0.5);
  const WalkCourse commanded = FollowedCourse(Read());
  EXPECT_NEAR(commanded.commanded_way, 0.4, 0.011);
  EXPECT_NEAR(commanded.commanded_turn, 0.1, 0.011);
  EXPECT_NEAR(Measure("walk_course_share"), 100, 5);
  EXPECT_NEAR(Measure("walk_turn_share"), 100, 12);
  // Half of it; against it; a robot that stands.
  Walk(0.25);
  turn(-0.5);
  EXPECT_NEAR(Measure("walk_course_share"), 50, 5);
  EXPECT_NEAR(Measure("walk_turn_share"), -100, 12);
  Walk(0);
  turn(0);
  EXPECT_EQ(Measure("walk_course_share"), 0);
  EXPECT_EQ(Measure("walk_turn_share"), 0);
  // It walks along its own axes: aside where it was to walk ahead.
  Walk(0.5);
  for (ground_truth_t& truth : truth_) {
    truth.base_orientation[0] = truth.base_orientation[3] = std::sqrt(0.5);
  }
  EXPECT_NEAR(Measure("walk_course_share"), 0, 1e-9);
  // What it slides while it lies is no way.
  Walk(0.5);
  turn(0.5);
  for (size_t t = 40; t < kTicks; ++t) truth_[t].fallen = 1;
  EXPECT_NEAR(Measure("walk_course_share"), 50, 5);
  // From an operator's command on it is not the scenario's course.
  answers_.resize(1);
  SetHeader(30, &answers_[0]);
  answers_[0].kind = operate::act_t::KIND_WALK;
  answers_[0].verdict = operate::answer_t::VERDICT_DONE;
  EXPECT_NEAR(FollowedCourse(Read()).commanded_way, 0.1, 0.011);
  EXPECT_EQ(FollowedCourse(Read()).commanded_turn, 0);
}

TEST_F(ForeignControllerTest, HowHighAFootCameDownIsTheTruths) {
  Walk(0.5);
  EXPECT_EQ(Measure("landing_height_max"), 0);
  for (size_t t = 15; t < kTicks; ++t) truth_[t].foot_pose[1].position[2] = -0.03;  // steps first
  for (size_t t = 60; t < kTicks; ++t) truth_[t].foot_pose[1].position[2] = 0.01;   // and third
  EXPECT_NEAR(Measure("landing_height_max"), 30, 1e-9);
  for (size_t t = 0; t < kTicks; ++t) {
    for (wrench_t& wrench : truth_[t].foot_wrench) wrench.force[2] = -kWeight;
  }
  EXPECT_TRUE(Unanswered("landing_height_max")) << "no foot came down";
  EXPECT_THAT(Missing("landing_height_max"), IsEmpty());
}

TEST_F(ForeignControllerTest, ARobotThatLiesIsDownWhateverTheSimulatorCallsIt) {
  Walk(0);
  EXPECT_EQ(Measure("fallen"), 0);
  for (size_t t = 60; t < kTicks; ++t) {
    truth_[t].com_position[2] = 0.3;
    for (pose_t& foot : truth_[t].foot_pose) foot.position[2] = -0.1;  // as on a stair below
  }
  EXPECT_EQ(Measure("fallen"), 0) << "0.4 m above its soles, of 0.7 m";
  for (size_t t = 70; t < kTicks; ++t) truth_[t].com_position[2] = 0.2;
  EXPECT_EQ(Measure("fallen"), kTicks - 70);
  EXPECT_EQ(DownTick(Read()), 70);
  for (size_t t = 65; t < kTicks; ++t) {
    truth_[t].base_orientation[0] = std::cos(0.55);
    truth_[t].base_orientation[1] = std::sin(0.55);
  }
  EXPECT_EQ(DownTick(Read()), 65);
}

TEST_F(ForeignControllerTest, ARobotInTheAirWithItsFeetPulledUpIsNotDown) {
  Walk(0);
  for (size_t t = 60; t < kTicks; ++t) {
    for (pose_t& foot : truth_[t].foot_pose) foot.position[2] = 0.5;
    for (wrench_t& wrench : truth_[t].foot_wrench) wrench.force[2] = 0;
  }
  EXPECT_EQ(DownTick(Read()), std::nullopt);
  for (size_t t = 70; t < kTicks; ++t) truth_[t].com_position[2] = 0.3;
  EXPECT_EQ(DownTick(Read()), 70) << "0.3 m above the ground, of 0.7 m";
}

// The table of needs is held to the metrics themselves: what a metric is not said to need changes
// nothing, and without any of what it needs it has no value.
TEST_F(ForeignControllerTest, EveryMetricNeedsWhatIsSaid) {
  without_.clear();
  Walk(0.5);
  for (size_t t = 0; t < kTicks; ++t) {
    push_[t].force[1] = t > 5 && t < 9 ? 50 : 0;
    balance_[t].active_x = t > 20 && t < 40;
    for (size_t foot = 0; foot < 2; ++foot) {
      command_[t].foot_wrench[foot].force[2] = sensors_[t].foot_wrench[foot].force[2] = -200;
    }
    if (t >= 30 && t < 60) {
      plan_[t].in_contact[1] = command_[t].in_contact[1] = 0;
      planner_[t].foot_state[1] = planner_status_t::FOOT_SWING;
      planner_[t].stepping = planner_status_t::STEPPING_SWINGING;
      planner_[t].step_reason = planner_status_t::REASON_WALK;
    }
  }
  RunRecord run = Read();
  const auto drop = [](RunRecord* record, const std::string& channel) {
    if (channel == "ROBOT_SENSORS") record->sensors = {};
    if (channel == "ROBOT_STATE") record->state = {};
    if (channel == "SUPPORT_PLAN") record->plan = {};
    if (channel == "PLANNER_STATUS") record->planner = {};
    if (channel == "TASK_TORQUE") record->task = {};
    if (channel == "BALANCE_TORQUE") record->balance = {};
    if (channel == "JOINT_COMMAND") record->command = {};
    if (channel == "EXTERNAL_PUSH") record->push = {};
    if (channel == "GROUND_TRUTH") record->truth = {};
  };
  int known = 0;
  for (const Metric& metric : Metrics()) {
    const Answer value = metric.compute(run);
    const std::vector<std::string> needs = TellNeeds(metric);
    const bool of_the_log = metric.name == "duration_reached" || metric.name.starts_with("log_");
    EXPECT_EQ(needs.empty(), of_the_log) << metric.name;
    if (!value) continue;
    ++known;
    EXPECT_THAT(MissingFor(metric, run), IsEmpty()) << metric.name;
    for (const char* channel :
         {"ROBOT_SENSORS", "ROBOT_STATE", "SUPPORT_PLAN", "PLANNER_STATUS", "TASK_TORQUE",
          "BALANCE_TORQUE", "JOINT_COMMAND", "EXTERNAL_PUSH", "GROUND_TRUTH"}) {
      if (metric.needs.find(channel) != std::string::npos) continue;
      RunRecord less = run;
      drop(&less, channel);
      EXPECT_EQ(metric.compute(less), value) << metric.name << " without " << channel;
    }
    for (const std::string& need : needs) {
      RunRecord less = run;
      bool all = true;  // of its channels can be dropped here
      for (size_t at = 0; at < need.size();) {
        const size_t end = std::min(need.find(", else ", at), need.size());
        const std::string channel = need.substr(at, need.find('.', at) - at);
        all = all && channel != "BRIDGE_STATUS" && channel != "DRIVE_COMMAND";
        drop(&less, channel);
        at = end + 7;
      }
      if (!all) continue;
      EXPECT_FALSE(metric.compute(less).has_value()) << metric.name << " without " << need;
      EXPECT_FALSE(MissingFor(metric, less).empty()) << metric.name << " without " << need;
    }
  }
  EXPECT_GT(known, 60);
}

}  // namespace
}  // namespace poise::logging
