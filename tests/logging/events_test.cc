#include "logging/events/events.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "components/step_planner/step_planner.pb.h"
#include "google/protobuf/text_format.h"
#include "tests/logging/record_fixture.h"

namespace poise::logging {

void PrintTo(const Event& event, std::ostream* out) {
  *out << event.time << " " << event.name << ": " << event.detail;
}

namespace {

using testing::AllOf;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

auto Is(double time, const std::string& name, const std::string& detail = "") {
  return AllOf(Field("time", &Event::time, DoubleNear(time, 1e-12)),
               Field("name", &Event::name, name),
               Field("detail", &Event::detail, HasSubstr(detail)));
}

class EventsTest : public RecordTest {
 protected:
  /// The plan in the run's own configuration.
  void Plan(const StepPlannerConfig& config) {
    ComponentConfig* part = spec_.add_config();
    part->set_component("step_planner");
    google::protobuf::TextFormat::PrintToString(config, part->mutable_text());
  }
  static StepPlannerConfig StepDown() {
    StepPlannerConfig config;
    Phase* stand = config.add_phase();
    stand->set_name("stand");
    stand->set_duration(0.04);
    Phase* down = config.add_phase();
    down->set_name("set down");
    down->set_support(RIGHT);
    down->mutable_foot()->set_foot(LEFT_FOOT);
    down->mutable_foot()->set_height_above_support(0.09);
    down->mutable_foot()->set_duration(0.1);
    return config;
  }
  /// The left foot off the ground from tick 20 on, in phase 1.
  void LiftLeft() {
    for (size_t t = 20; t < kTicks; ++t) {
      planner_[t].phase = 1;
      plan_[t].in_contact[1] = command_[t].in_contact[1] = 0;
      planner_[t].foot_state[1] = planner_status_t::FOOT_SWING;
      planner_[t].foot_pose[1].position[2] = plan_[t].foot_reference[1].position[2] = 0.12;
    }
  }
  std::vector<Event> Named(const std::string& name) {
    std::vector<Event> found;
    for (const Event& event : Events(Read())) {
      if (event.name == name) found.push_back(event);
    }
    return found;
  }
};

TEST_F(EventsTest, ARunAtRestBeginsAndEnds) {
  spec_.set_num_ticks(kTicks);
  EXPECT_THAT(Events(Read()),
              ElementsAre(Is(0, "phase_began", "phase 0"), Is(0.2, "run_ended", "planned end")));
}

TEST_F(EventsTest, ARunThatFallsEndsEarly) {
  spec_.set_num_ticks(2 * kTicks);
  for (size_t t = 70; t < kTicks; ++t) {
    truth_[t].fallen = 1;
    truth_[t].com_position[2] = 0.4;
  }
  EXPECT_THAT(Events(Read()), ElementsAre(Is(0, "phase_began"), Is(0.14, "fall", "0.400 m"),
                                          Is(0.2, "run_ended", "0.200 s before")));
}

// A hot ankle that gives ever less, a knee at its limit for some ticks with a break of one.
TEST_F(EventsTest, MotorsAtTheirLimitsAreNamedWithTheirTorques) {
  const std::string ankle = Read().robot.joints()[4].name, knee = Read().robot.joints()[3].name;
  for (size_t t = 0; t < kTicks; ++t) {
    bridge_[t].state = bridge_status_t::STATE_RUNNING;
    command_[t].torque[4] = 14;
    bridge_[t].applied_torque[4] = t < 40 ? 12.7 : std::max(7.5, 12.7 - 0.2 * double(t - 39));
    if (t >= 40) bridge_[t].saturated[4] = bridge_status_t::LIMIT_THERMAL;
    command_[t].stiffness[3] = 100;
    command_[t].position[3] = -0.5;
    bridge_[t].applied_torque[3] = t < 20 ? -20 : -30;
    if (t >= 20 && t < 25 && t != 22) bridge_[t].saturated[3] = bridge_status_t::LIMIT_TORQUE;
    if (t >= 50) bridge_[t].saturated[5] = bridge_status_t::LIMIT_IMPEDANCE;
  }
  EXPECT_THAT(Named("impedance_cut"),
              ElementsAre(Is(0.1, "impedance_cut", Read().robot.joints()[5].name + ": stiffness")));
  EXPECT_THAT(Named("motor_hot"),
              ElementsAre(Is(0.08, "motor_hot", ankle + ": 12.7 to 7.5 N·m, of 14.0 N·m wanted")));
  EXPECT_THAT(Named("motor_hot_ends"), testing::IsEmpty());
  EXPECT_THAT(
      Named("motor_limited"),
      ElementsAre(Is(0.04, "motor_limited", knee + ": -20.0 to -30.0 N·m, of -50.0 N·m wanted")));
  EXPECT_THAT(Named("motor_limited_ends"),
              ElementsAre(Is(0.05, "motor_limited_ends", knee + ", after 0.010 s")));
  for (bridge_status_t& bridge : bridge_) bridge.state = bridge_status_t::STATE_DAMPING;
  EXPECT_THAT(Named("motor_hot"), testing::IsEmpty()) << "nobody wants anything then";
}

TEST_F(EventsTest, ALoadedSoleThatTipsIsTold) {
  const robot::RobotModel robot = Read().robot;
  const double half = 0.5 * robot.feet()[1].length, weight = robot.total_mass() * robot::kGravity;
  for (size_t t = 0; t < kTicks; ++t) {
    const double load = t < 70 ? 0.5 * weight : 0.1 * weight;
    truth_[t].foot_wrench[1].force[2] = -load;
    truth_[t].foot_wrench[1].moment[1] = (t < 30 ? 0.9 : 1.0) * half * load;
    truth_[t].foot_wrench[0].force[2] = -load;
  }
  EXPECT_THAT(Named("sole_on_edge"), ElementsAre(Is(0.06, "sole_on_edge", "left foot, which")));
  EXPECT_THAT(Named("sole_on_edge_ends"), ElementsAre(Is(0.14, "sole_on_edge_ends")));
}

TEST_F(EventsTest, PhasesCarryTheirNames) {
  LiftLeft();
  EXPECT_THAT(Named("phase_began"),
              ElementsAre(Is(0, "phase_began", "phase 0"), Is(0.04, "phase_began", "phase 1")));
  Plan(StepDown());
  EXPECT_THAT(Named("phase_began"), ElementsAre(Is(0, "phase_began", "phase 0, stand"),
                                                Is(0.04, "phase_began", "phase 1, set down")));
}

TEST_F(EventsTest, APhaseSaysWhatTheOneBeforeCameTo) {
  Plan(StepDown());
  for (size_t t = 20; t < kTicks; ++t) {
    planner_[t].phase = t < 60 ? 1 : 0;
    planner_[t].began_by =
        t < 60 ? planner_status_t::OUTCOME_DONE : planner_status_t::OUTCOME_NO_SURFACE;
  }
  EXPECT_THAT(Named("phase_began"),
              ElementsAre(Field(&Event::detail, "phase 0, stand"),
                          Field(&Event::detail, "phase 1, set down"),
                          Field(&Event::detail, "phase 0, stand: no surface was found")));
}

// Its time begins anew.
TEST_F(EventsTest, APhaseThatFollowsItselfBeginsAgain) {
  for (size_t t = 0; t < kTicks; ++t) {
    planner_[t].phase_time = kPeriod * static_cast<double>(t % 50);
    planner_[t].began_by =
        t < 50 ? planner_status_t::OUTCOME_NONE : planner_status_t::OUTCOME_TIMEOUT;
  }
  EXPECT_THAT(Named("phase_began"),
              ElementsAre(Is(0, "phase_began"), Is(0.1, "phase_began", "waited for too long")));
}

// The phases that follow each other when all goes well count, in whatever order they are listed.
TEST_F(EventsTest, TheReferencesEndIsThatOfThePhaseThatFollows) {
  StepPlannerConfig config = StepDown();
  *config.add_phase() = config.phase(1);
  config.mutable_phase(1)->set_duration(0.04);
  config.mutable_phase(1)->mutable_foot()->set_height_above_support(0.12);
  Phase* elsewhere = config.add_phase();
  *elsewhere = config.phase(2);
  elsewhere->set_name("lower still");
  elsewhere->mutable_foot()->set_height_above_support(0.05);
  config.mutable_phase(1)->add_next()->set_to("lower still");
  Plan(config);
  LiftLeft();
  for (size_t t = 50; t < kTicks; ++t) {
    planner_[t].foot_state[1] = planner_status_t::FOOT_TOUCHING;
    planner_[t].foot_pose[1].position[2] = 0.125;
  }
  EXPECT_THAT(Named("contact_early"), ElementsAre(Is(0.1, "contact_early", "75.0 mm above")));
}

TEST_F(EventsTest, APlanThatDoesNotFitLeavesThePhasesUnnamed) {
  ComponentConfig* part = spec_.add_config();
  part->set_component("step_planner");
  part->set_text("phase { name: \"stand\" warp: 9 }");
  EXPECT_THAT(Named("phase_began"), ElementsAre(Field(&Event::detail, "phase 0")));
}

TEST_F(EventsTest, SupportChangeNamesTheJointOfTheLargestStep) {
  LiftLeft();
  for (size_t t = 20; t < kTicks; ++t) {
    command_[t].torque[3] = -0.21;
    command_[t].torque[9] = 0.1;
  }
  const RunRecord run = Read();
  EXPECT_THAT(Named("support_changed"),
              ElementsAre(Is(0.04, "support_changed",
                             "both feet to right foot; largest torque step 0.21 N·m in " +
                                 run.robot.joints()[3].name)));
}

TEST_F(EventsTest, TransitionsAndWaiting) {
  for (size_t t = 5; t < 10; ++t) {
    plan_[t].status = support_plan_t::STATUS_WAITING;
    planner_[t].waiting_for = planner_status_t::WAITING_COM;
  }
  for (size_t t = 10; t < 20; ++t) {
    plan_[t].transition = support_plan_t::TRANSITION_UNLOADING;
    plan_[t].transition_foot = 1;
  }
  for (size_t t = 40; t < 50; ++t) {
    plan_[t].transition = support_plan_t::TRANSITION_LOADING;
    plan_[t].transition_foot = 0;
  }
  for (size_t t = 60; t < kTicks; ++t)
    planner_[t].waiting_for = planner_status_t::WAITING_NO_SURFACE;
  EXPECT_THAT(
      Events(Read()),
      ElementsAre(Is(0, "phase_began"), Is(0.01, "waiting_begins", "above the stance sole"),
                  Is(0.02, "waiting_ends", "after 0.010 s"),
                  Is(0.02, "unloading_begins", "left foot"),
                  Is(0.04, "unloading_ends", "left foot, after 0.020 s"),
                  Is(0.08, "loading_begins", "right foot"), Is(0.1, "loading_ends", "right foot"),
                  Is(0.12, "waiting_begins", "no surface"), Is(0.2, "run_ended")));
}

TEST_F(EventsTest, AContactAboveTheReferencesEndIsEarly) {
  Plan(StepDown());
  LiftLeft();
  for (size_t t = 50; t < kTicks; ++t) {
    planner_[t].foot_state[1] = planner_status_t::FOOT_TOUCHING;
    planner_[t].foot_pose[1].position[2] = 0.115;
  }
  EXPECT_THAT(Named("touch_down"), ElementsAre(Is(0.1, "touch_down", "left foot, 115.0 mm above")));
  EXPECT_THAT(Named("contact_early"),
              ElementsAre(Is(0.1, "contact_early", "left foot, 25.0 mm above")));
  EXPECT_TRUE(Named("contact_late").empty());
}

// What comes in a phase before the one that lowers the foot is early too.
TEST_F(EventsTest, ASoleThatBouncesTouchesDownOnce) {
  Plan(StepDown());
  LiftLeft();
  for (size_t t = 50; t < kTicks; ++t) {
    planner_[t].foot_state[1] =
        t % 20 < 10 ? planner_status_t::FOOT_TOUCHING : planner_status_t::FOOT_SWING;
  }
  EXPECT_THAT(Named("touch_down"), ElementsAre(Is(0.12, "touch_down", "left foot")));
  EXPECT_EQ(Named("contact_early").size(), 1u);
}

TEST_F(EventsTest, AContactWhileTheFootHoversIsEarly) {
  StepPlannerConfig config = StepDown();
  *config.add_phase() = config.phase(1);
  config.mutable_phase(1)->set_duration(0.04);
  config.mutable_phase(1)->mutable_foot()->set_height_above_support(0.12);
  Plan(config);
  LiftLeft();
  for (size_t t = 50; t < kTicks; ++t) {
    planner_[t].foot_state[1] = planner_status_t::FOOT_TOUCHING;
    planner_[t].foot_pose[1].position[2] = 0.125;  // 5 mm above where it hovers
  }
  EXPECT_THAT(Named("contact_early"), ElementsAre(Is(0.1, "contact_early", "35.0 mm above")));
}

TEST_F(EventsTest, AContactFoundBySearchingIsLate) {
  Plan(StepDown());
  LiftLeft();
  for (size_t t = 30; t < 50; ++t) planner_[t].foot_state[1] = planner_status_t::FOOT_SEARCHING;
  for (size_t t = 50; t < kTicks; ++t) {
    planner_[t].foot_state[1] = planner_status_t::FOOT_SUPPORT;
    planner_[t].foot_pose[1].position[2] = 0.06;
  }
  EXPECT_THAT(Named("searching"), ElementsAre(Is(0.06, "searching", "left foot")));
  EXPECT_THAT(Named("touch_down"), ElementsAre(Is(0.1, "touch_down", "60.0 mm")));
  EXPECT_THAT(Named("contact_late"), ElementsAre(Is(0.1, "contact_late", "30.0 mm below")));
}

TEST_F(EventsTest, AContactNearTheReferencesEndIsAsExpected) {
  StepPlannerConfig config = StepDown();
  Plan(config);
  LiftLeft();
  for (size_t t = 50; t < kTicks; ++t) {
    planner_[t].foot_state[1] = planner_status_t::FOOT_TOUCHING;
    planner_[t].foot_pose[1].position[2] = 0.095;  // 5 mm above its end
  }
  EXPECT_EQ(Named("touch_down").size(), 1u);
  EXPECT_TRUE(Named("contact_early").empty());
}

TEST_F(EventsTest, AReferenceWithoutHeightEndsBelowWhereItBegan) {
  StepPlannerConfig config = StepDown();
  config.mutable_phase(1)->mutable_foot()->clear_height_above_support();
  config.mutable_phase(1)->mutable_foot()->set_z(-0.1);  // from 0.12 to 0.02
  Plan(config);
  LiftLeft();
  for (size_t t = 50; t < kTicks; ++t) planner_[t].foot_state[1] = planner_status_t::FOOT_TOUCHING;
  EXPECT_THAT(Named("contact_early"), ElementsAre(Is(0.1, "contact_early", "100.0 mm above")));
}

TEST_F(EventsTest, NoSurface) {
  LiftLeft();
  for (size_t t = 50; t < kTicks; ++t) {
    planner_[t].foot_state[1] = planner_status_t::FOOT_RETRACTED;
    planner_[t].foot_pose[1].position[2] = -0.06;
  }
  EXPECT_THAT(Named("no_surface"), ElementsAre(Is(0.1, "no_surface", "-60.0 mm")));
}

TEST_F(EventsTest, ContactIsLostWhenALoadedFootReadsOnlyNoise) {
  for (size_t t = 0; t < kTicks; ++t) {
    // The right foot is to carry 300 N and does, but for ticks 30..39; the left foot 5 N.
    command_[t].foot_wrench[0].force[2] = -300;
    // And for ticks 60..63, which is too short to be a loss.
    sensors_[t].foot_wrench[0].force[2] = (t >= 30 && t < 40) || (t >= 60 && t < 64) ? 2 : -290;
    command_[t].foot_wrench[1].force[2] = -5;
  }
  EXPECT_THAT(Named("contact_lost"), ElementsAre(Is(0.06, "contact_lost", "right foot")));
  EXPECT_THAT(Named("contact_regained"), ElementsAre(Is(0.08, "contact_regained", "300 N")));
}

TEST_F(EventsTest, BalancingOfEachAxis) {
  for (size_t t = 20; t < 30; ++t) {
    balance_[t].active_y = 1;
    balance_[t].cop_task[1] = -0.085;
  }
  balance_[99].active_x = 1;
  for (size_t t = 25; t < 28; ++t) {
    balance_[t].status = balance_torque_t::STATUS_NOT_ACHIEVED;
    balance_[t].resultant_task.force[2] = -400;
  }
  command_[26].eta_feasible = 0;
  command_[26].eta_max = 1;
  EXPECT_THAT(Events(Read()),
              ElementsAre(Is(0, "phase_began"),
                          Is(0.04, "balancing_on", "y: CoP of the task torque -85.0 mm, limit 70"),
                          Is(0.05, "cop_not_achieved_begins", "limits (130.0, 70.0) mm"),
                          Is(0.052, "eta_infeasible_begins"), Is(0.054, "eta_infeasible_ends"),
                          Is(0.056, "cop_not_achieved_ends", "after 0.006 s"),
                          Is(0.06, "balancing_off", "y, after 0.020 s"),
                          Is(0.198, "balancing_on", "x"), Is(0.2, "run_ended")));
}

TEST_F(EventsTest, ACentreOfPressureThatIsNotKeptIsNeverCalledWithinItsLimits) {
  for (size_t t = 25; t < 28; ++t) {
    balance_[t].status = balance_torque_t::STATUS_NOT_ACHIEVED;
    balance_[t].resultant_task.force[2] = 120;
  }
  for (size_t t = 40; t < 42; ++t) {
    balance_[t].status = balance_torque_t::STATUS_NOT_ACHIEVED;
    balance_[t].resultant_task.force[2] = -400;
    balance_[t].region = balance_torque_t::REGION_POLYGON;
    balance_[t].num_corners = 3;
    balance_[t].corner_x[1] = balance_[t].corner_y[2] = 0.3;
    balance_[t].cop[0] = balance_[t].cop[1] = 0.2;  // within the corners' extent
  }
  EXPECT_THAT(Named("cop_not_achieved_begins"),
              ElementsAre(Is(0.05, "cop_not_achieved_begins", "no CoP: the task torque would pull"),
                          Is(0.08, "cop_not_achieved_begins",
                             "CoP (200.0, 200.0) mm, 70.7 mm outside the soles' region")));
}

TEST_F(EventsTest, AStepThatAWalkMakesAnywayIsNotCalledFor) {
  for (size_t t = 30; t < 80; ++t) {
    planner_status_t& planner = planner_[t];
    planner.step_needed = 1;
    planner.capture_margin = -0.05;
    planner.stepping = planner_status_t::STEPPING_SWINGING;
    planner.step_reason = planner_status_t::REASON_WALK;
    planner.step_foot = 1;
    planner.foot_pose[0].position[1] = -0.1;
    planner.foothold[0] = 0.3;
    planner.foothold[1] = 0.1;
    planner.capture_point[0] = 0.15;
    planner.capture_point[1] = t < 60 ? 0 : -0.5;  // pushed aside
  }
  EXPECT_THAT(Named("step_needed"), ElementsAre(Is(0.12, "step_needed", "a foot at")));
  for (size_t t = 30; t < 80; ++t) planner_[t].step_reason = planner_status_t::REASON_OUTSIDE;
  EXPECT_THAT(Named("step_needed"), ElementsAre(Is(0.06, "step_needed", "a foot at")));
}

TEST_F(EventsTest, AStepThatIsNeededSaysWhereAndByWhen) {
  for (size_t t = 30; t < 60; ++t) {
    planner_[t].step_needed = 1;
    planner_[t].capture_margin = -0.0125;
    planner_[t].step_position[0] = 0.1;
    planner_[t].step_position[1] = -0.45;
    planner_[t].step_time = 0.32;
  }
  EXPECT_THAT(Named("step_needed"),
              ElementsAre(Is(0.06, "step_needed",
                             "a foot at (0.10, -0.45) m within 0.32 s; capture point 12.5 mm")));
  EXPECT_THAT(Named("step_needed_ends"),
              ElementsAre(Is(0.12, "step_needed_ends", "after 0.060 s")));
}

/// The left foot steps from (0, 0.1) to be planned at (0.3, 0.1), then (0.32, 0.1); lands at
/// tick 60.
class StepEventsTest : public EventsTest {
 protected:
  StepEventsTest() {
    for (size_t t = 0; t < kTicks; ++t) {
      planner_status_t& planner = planner_[t];
      planner.step_foot = t < 30 ? -1 : 1;
      planner.num_steps = t < 30 ? 0 : 1;
      planner.step_reason = planner_status_t::REASON_OUTSIDE;
      planner.stepping = t < 30   ? planner_status_t::STEPPING_NONE
                         : t < 60 ? planner_status_t::STEPPING_SWINGING
                         : t < 80 ? planner_status_t::STEPPING_LOADING
                                  : planner_status_t::STEPPING_NONE;
      planner.foothold[0] = t < 40 ? 0.3 : 0.32;
      planner.foothold[1] = 0.1;
      planner.foot_pose[1].position[0] = t < 60 ? 0 : 0.31;
      planner.foot_pose[1].position[1] = 0.1;
      planner.capture_margin = -0.0125;
      planner.foothold_margin = 0.04;
    }
  }
};

TEST_F(StepEventsTest, AStepThatLandsSaysWhereBesideThePlan) {
  EXPECT_THAT(Named("step_begins"),
              ElementsAre(Is(0.06, "step_begins", "left foot to (0.30, 0.10) m")));
  EXPECT_THAT(
      Named("step_lands"),
      ElementsAre(Is(0.12, "step_lands",
                     "left foot at (0.31, 0.10) m, 10 mm from its last foothold, 310 mm from "
                     "where it stood (planned at first 300 mm); capture point 12.5 mm outside the "
                     "soles (planned 40.0 mm inside the soles)")));
  EXPECT_EQ(Named("step_rests").size(), 1u);
}

TEST_F(StepEventsTest, AStepOfAWalkPlansNoCapturePoint) {
  for (planner_status_t& planner : planner_) {
    planner.step_reason = planner_status_t::REASON_WALK;
    planner.capture_margin = 0.07;
  }
  EXPECT_THAT(Named("step_lands"),
              ElementsAre(Field(&Event::detail, testing::EndsWith("70.0 mm inside the soles"))));
}

TEST_F(EventsTest, BridgeStatesCarryTheirReason) {
  for (size_t t = 0; t < kTicks; ++t) {
    bridge_[t].state = t < 2    ? bridge_status_t::STATE_INIT
                       : t < 50 ? bridge_status_t::STATE_RUNNING
                                : bridge_status_t::STATE_DAMPING;
    bridge_[t].reason =
        t < 50 ? bridge_status_t::REASON_NONE : bridge_status_t::REASON_COMMAND_STALE;
  }
  EXPECT_THAT(Named("bridge_state"),
              ElementsAre(Is(0.004, "bridge_state", "init to running"),
                          Is(0.1, "bridge_state", "running to damping: command stale")));
}

TEST_F(EventsTest, AStopNamesTheJointThatItIsAbout) {
  for (size_t t = 0; t < kTicks; ++t) {
    bridge_[t].state = t < 50 ? bridge_status_t::STATE_RUNNING : bridge_status_t::STATE_STOPPING;
    bridge_[t].reason =
        t < 50 ? bridge_status_t::REASON_NONE : bridge_status_t::REASON_JOINT_VELOCITY;
    bridge_[t].reason_joint = t < 50 ? -1 : 3;
  }
  EXPECT_THAT(Named("bridge_state"),
              ElementsAre(Is(0.1, "bridge_state",
                             "running to stopping: joint too fast (right_knee_pitch)")));
}

TEST_F(EventsTest, APushStandsOutOfItsSensorsNoise) {
  // Noise of a sign that changes: differences of 0.4 N everywhere; a push of 20 ticks upon it.
  for (size_t t = 0; t < kTicks; ++t) push_[t].force[0] = t % 2 == 0 ? 0.2 : -0.2;
  EXPECT_TRUE(Named("push_begins").empty());
  for (size_t t = 40; t <= 60; ++t) {
    push_[t].force[1] = 100 * std::sin(std::numbers::pi * static_cast<double>(t - 40) / 20);
  }
  EXPECT_THAT(Named("push_begins"), ElementsAre(Is(0.082, "push_begins")));
  EXPECT_THAT(Named("push_peak"), ElementsAre(Is(0.1, "push_peak", "100.0 N")));
  EXPECT_THAT(Named("push_ends"), ElementsAre(Is(0.12, "push_ends", "after 0.038 s")));
}

TEST_F(EventsTest, APushWithAShortDipIsOne) {
  for (size_t t = 40; t < 50; ++t) push_[t].force[1] = t == 45 ? 0 : 10;
  EXPECT_EQ(Named("push_begins").size(), 1u);
  for (size_t t = 90; t < 95; ++t) push_[t].force[1] = 10;
  EXPECT_EQ(Named("push_begins").size(), 2u);
}

TEST_F(EventsTest, ARunInProgressTellsNothingThatMayChange) {
  spec_.set_num_ticks(2 * kTicks);
  for (size_t t = 0; t < kTicks; ++t) {
    command_[t].foot_wrench[0].force[2] = -300;
    // Lost for 4 ticks at the end: a rattle, or a loss that only begins.
    sensors_[t].foot_wrench[0].force[2] = t >= kTicks - 4 ? 2 : -290;
    if (t >= 90) push_[t].force[1] = static_cast<double>(t);
  }
  const RunRecord run = Read();
  EXPECT_THAT(Events(run, false), ElementsAre(Is(0, "phase_began"), Is(0.18, "push_begins")));
  EXPECT_THAT(Events(run), ElementsAre(Is(0, "phase_began"), Is(0.18, "push_begins"),
                                       Is(0.192, "contact_lost"), Is(0.198, "push_peak", "99.0 N"),
                                       Is(0.2, "run_ended", "0.200 s before")));
}

TEST_F(EventsTest, APartOfARunNeitherBeginsNorEndsIt) {
  spec_.set_num_ticks(2 * kTicks);
  spec_.mutable_cut()->set_first_tick(40);
  spec_.mutable_cut()->set_last_tick(kTicks - 1);
  for (size_t t = 0; t < kTicks; ++t) balance_[t].active_y = t < 60 ? 1 : 0;
  EXPECT_THAT(
      Events(Read()),
      ElementsAre(Is(0.08, "phase_began", "or earlier"), Is(0.08, "balancing_on", "or earlier"),
                  Is(0.12, "balancing_off"), Is(0.2, "log_ends", "part of a longer log")));
}

TEST_F(EventsTest, AMissingMessageEndsNothing) {
  for (size_t t = 20; t < 30; ++t) balance_[t].active_y = 1;
  balance_[25].run_id = 43;  // refused
  EXPECT_EQ(Named("balancing_on").size(), 1u);
}

/// Makes the answer of the component with this index, in the log of this run.
operate::answer_t Answered(int64_t id, int64_t tick, int32_t component, int8_t verdict) {
  operate::answer_t answer{};
  SetHeader(tick, &answer);
  answer.id = id;
  answer.component = component;
  answer.kind = operate::act_t::KIND_PUSH;
  answer.verdict = verdict;
  return answer;
}

TEST_F(EventsTest, AnOperatorsActThatIsRefusedShows) {
  using operate::answer_t;
  answers_ = {Answered(7, 10, 0, answer_t::VERDICT_DONE),
              Answered(8, 20, 0, answer_t::VERDICT_RANGE),
              Answered(8, 21, 0, answer_t::VERDICT_RANGE),  // the same act, answered again
              Answered(9, 40, 99, answer_t::VERDICT_NOT_NOW)};
  const std::string who = spec_.graph().component(0).name();
  EXPECT_THAT(Named("act_refused"),
              ElementsAre(Is(0.04, "act_refused", "push by " + who + ": a number is out of range"),
                          Is(0.08, "act_refused", "push by component 99: not now")));
  EXPECT_THAT(Named("act_refused").front().detail, testing::Not(HasSubstr("times")));
}

TEST_F(EventsTest, ManyRefusalsOfADragAreOneEvent) {
  using operate::answer_t;
  for (int64_t i = 0; i < 30; ++i) {
    answers_.push_back(Answered(i, 10 + i, 0, answer_t::VERDICT_RANGE));
  }
  answers_.push_back(Answered(50, 35, 0, answer_t::VERDICT_FULL));  // another reason
  EXPECT_THAT(Named("act_refused"), ElementsAre(Is(0.02, "act_refused", "out of range; 30 times"),
                                                Is(0.07, "act_refused", "too many acts wait")));
}

TEST_F(EventsTest, ARefusedActSaysWhichAndWhy) {
  using operate::answer_t;
  answer_t together = Answered(3, 30, 0, answer_t::VERDICT_NOT_NOW);
  together.kind = operate::act_t::KIND_STAND;
  answers_ = {together};
  EXPECT_THAT(Named("act_refused"),
              ElementsAre(Is(0.06, "act_refused", "does not stand still on both feet")));
  EXPECT_THAT(Named("act_refused").front().detail, HasSubstr("feet side by side by "));
}

TEST_F(EventsTest, AnAnswerThatIsNotOfThisRunOrTellsNoTickOfItIsNone) {
  using operate::answer_t;
  answer_t other = Answered(1, 10, 0, answer_t::VERDICT_RANGE);
  other.run_id += 1;
  answers_ = {other, Answered(2, -5, 0, answer_t::VERDICT_RANGE),
              Answered(3, int64_t{1} << 50, 0, answer_t::VERDICT_RANGE)};
  EXPECT_TRUE(Named("act_refused").empty());
}

}  // namespace
}  // namespace poise::logging
