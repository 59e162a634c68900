// Phases, transitions and references, without bus or robot.
#include "components/task_controller/phase_schedule.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "components/framework/configuration.h"
#include "components/task_controller/reference_generator.h"

namespace poise {
namespace {

constexpr std::array<bool, 2> kOverBoth{true, true};
constexpr std::array<bool, 2> kOverNeither{false, false};
constexpr std::array<bool, 2> kConfirmed{true, true};
constexpr std::array<bool, 2> kUnconfirmed{false, false};
constexpr double kTick = 0.002;

const std::string kGains =
    "com { kp: 225 kd: 10 } orientation { kp: 225 kd: 10 } foot { kp: 225 kd: 10 } ";

TaskControllerConfig Parse(const std::string& text) {
  TaskControllerConfig config;
  ParseTextProto(text, "test", &config);
  return config;
}

PhaseSchedule Schedule(const std::string& phases) {
  const TaskControllerConfig config = Parse(kGains + phases);
  CheckTaskControllerConfig(config);
  return PhaseSchedule(config);
}

// Section 7.4, then back: unload the left foot in 0.5-1.0 s, stand on the right, load it again
// from 2.0 s.
const std::string kThere =
    "phase { start: 0 transition { kind: UNLOAD foot: LEFT_FOOT delay: 0.5 duration: 0.5 } } "
    "phase { start: 1 support: RIGHT } "
    "phase { start: 2 transition { kind: LOAD foot: LEFT_FOOT delay: 0.2 duration: 0.4 } } ";

TEST(PhaseSchedule, FollowsTheScenarioToTheTick) {
  PhaseSchedule schedule = Schedule(kThere);
  for (int tick = 0; tick <= 1500; ++tick) {
    const double time = kTick * tick;
    const ScheduleState& state = schedule.Advance(time, kOverBoth, kConfirmed);
    SCOPED_TRACE(time);
    const int phase = tick < 500 ? 0 : tick < 1000 ? 1 : 2;
    ASSERT_EQ(state.phase, phase);
    ASSERT_EQ(state.phase_began, tick == 0 || tick == 500 || tick == 1000);
    ASSERT_FALSE(state.waiting());
    TransitionKind kind = TransitionKind::kNone;
    double progress = 0;
    if (tick >= 250 && tick < 500) {
      kind = TransitionKind::kUnloading;
      progress = (time - 0.5) / 0.5;
    } else if (tick >= 1000 && tick < 1300) {
      kind = TransitionKind::kLoading;
      progress = std::max(0.0, (time - 2.2) / 0.4);
    }
    ASSERT_EQ(state.transition, kind);
    ASSERT_NEAR(state.progress, progress, 1e-8);
    ASSERT_EQ(state.transition_foot, kind == TransitionKind::kNone ? -1 : 1);
  }
}

TEST(PhaseSchedule, UnloadingAndAllThatFollowsWaitForTheCom) {
  PhaseSchedule schedule = Schedule(kThere);
  // The COM stands above the left foot only: the foot that is to be lifted does not count.
  const std::array<bool, 2> over_left{false, true};
  for (int tick = 0; tick < 400; ++tick) {
    const ScheduleState& state = schedule.Advance(kTick * tick, over_left, kConfirmed);
    ASSERT_EQ(state.waiting_for, tick >= 250 ? WaitingFor::kCom : WaitingFor::kNothing) << tick;
    ASSERT_EQ(state.transition, TransitionKind::kNone);
    ASSERT_EQ(state.phase, 0);
  }
  // It arrives at tick 400: 149 waiting steps were lost, the rest of the schedule keeps its
  // distances.
  int unloading = -1, single = -1, second_double = -1;
  for (int tick = 400; tick < 1800; ++tick) {
    const ScheduleState& state = schedule.Advance(kTick * tick, kOverBoth, kConfirmed);
    ASSERT_FALSE(state.waiting());
    if (unloading < 0 && state.transition == TransitionKind::kUnloading) unloading = tick;
    if (single < 0 && state.phase == 1) single = tick;
    if (second_double < 0 && state.phase == 2) second_double = tick;
  }
  EXPECT_EQ(unloading, 400);
  EXPECT_NEAR(single - unloading, 250, 1);
  EXPECT_EQ(second_double - single, 500);
}

TEST(PhaseSchedule, TheLiftOffWaitsWhenTheComLeavesDuringTheRamp) {
  PhaseSchedule schedule = Schedule(kThere);
  for (int tick = 0; tick < 400; ++tick) schedule.Advance(kTick * tick, kOverBoth, kConfirmed);
  for (int tick = 400; tick < 600; ++tick) {
    const ScheduleState& state = schedule.Advance(kTick * tick, kOverNeither, kConfirmed);
    ASSERT_EQ(state.phase, 0) << tick;
    ASSERT_EQ(state.waiting(), tick >= 500) << tick;
    ASSERT_EQ(state.transition, TransitionKind::kUnloading);
    if (tick >= 500) {
      ASSERT_EQ(state.progress, 1) << tick;
    }
  }
  EXPECT_EQ(schedule.Advance(kTick * 600, kOverBoth, kConfirmed).phase, 1);
  EXPECT_FALSE(schedule.state().waiting());
  int second_double = -1;
  for (int tick = 601; tick < 1400 && second_double < 0; ++tick) {
    if (schedule.Advance(kTick * tick, kOverNeither, kConfirmed).phase == 2) second_double = tick;
  }
  EXPECT_NEAR(second_double - 600, 500, 1);  // later phases keep their distances
}

TEST(PhaseSchedule, NeverLiftsAFootUnderTheCom) {
  PhaseSchedule schedule = Schedule(kThere);
  for (int tick = 0; tick < 10000; ++tick) {
    ASSERT_EQ(schedule.Advance(kTick * tick, kOverNeither, kConfirmed).phase, 0);
  }
  EXPECT_TRUE(schedule.state().waiting());
}

TEST(PhaseSchedule, AnInstantUnloadingIsCheckedToo) {
  PhaseSchedule schedule = Schedule(
      "phase { start: 0 transition { kind: UNLOAD foot: RIGHT_FOOT delay: 1 duration: 0 } } "
      "phase { start: 1 support: LEFT } ");
  for (int tick = 0; tick < 1000; ++tick) {
    ASSERT_EQ(schedule.Advance(kTick * tick, kOverNeither, kConfirmed).phase, 0);
  }
  EXPECT_EQ(schedule.Advance(kTick * 1000, kOverBoth, kConfirmed).progress, 1);
  EXPECT_EQ(schedule.Advance(kTick * 1001, kOverBoth, kConfirmed).phase, 1);
}

TEST(PhaseSchedule, DoubleSupportWaitsForTheFootThatComesDown) {
  PhaseSchedule schedule = Schedule(kThere);
  const std::array<bool, 2> only_right{true, false}, only_left{false, true};
  for (int tick = 0; tick < 1400; ++tick) {
    const ScheduleState& state = schedule.Advance(kTick * tick, kOverBoth, only_right);
    ASSERT_EQ(state.phase, tick < 500 ? 0 : 1) << tick;
    ASSERT_EQ(state.waiting_for, tick < 1000 ? WaitingFor::kNothing : WaitingFor::kContact) << tick;
    ASSERT_EQ(schedule.BeforeTouchDown(), tick >= 500);
  }
  const ScheduleState& state = schedule.Advance(kTick * 1400, kOverBoth, only_left);
  EXPECT_EQ(state.phase, 2);
  EXPECT_TRUE(state.phase_began);
  EXPECT_FALSE(state.waiting());
  // The loading keeps its distance from the phase's start: 0.2 s.
  int loading = -1;
  for (int tick = 1401; tick < 1700 && loading < 0; ++tick) {
    // A contact lost again does not end double support.
    if (schedule.Advance(kTick * tick, kOverBoth, kUnconfirmed).progress > 0) loading = tick;
  }
  EXPECT_NEAR(loading - 1400, 100, 2);
  EXPECT_EQ(schedule.state().phase, 2);
}

TEST(PhaseSchedule, TheScheduleAloneDecidesWhenNoConfirmationIsRequired) {
  PhaseSchedule schedule = Schedule("contact { required: false } " + kThere);
  for (int tick = 0; tick <= 1000; ++tick) schedule.Advance(kTick * tick, kOverBoth, kUnconfirmed);
  EXPECT_EQ(schedule.state().phase, 2);
}

TEST(PhaseSchedule, OnlyDoubleSupportAfterSingleSupportNeedsConfirmation) {
  PhaseSchedule schedule = Schedule(
      "phase { start: 0 } phase { start: 0.1 } phase { start: 0.2 support: LEFT } "
      "phase { start: 0.3 support: LEFT } ");
  for (int tick = 0; tick <= 150; ++tick) {
    ASSERT_FALSE(schedule.Advance(kTick * tick, kOverBoth, kUnconfirmed).waiting());
    ASSERT_FALSE(schedule.BeforeTouchDown());
  }
  EXPECT_EQ(schedule.state().phase, 3);
}

TEST(PhaseSchedule, ContactsOfASupport) {
  EXPECT_EQ(ContactsOf(DOUBLE), (std::array<bool, 2>{true, true}));
  EXPECT_EQ(ContactsOf(RIGHT), (std::array<bool, 2>{true, false}));
  EXPECT_EQ(ContactsOf(LEFT), (std::array<bool, 2>{false, true}));
}

struct Refused {
  const char* text;
  const char* field;
};

class RefusedConfig : public testing::TestWithParam<Refused> {};

TEST_P(RefusedConfig, NamesTheField) {
  try {
    CheckTaskControllerConfig(Parse(GetParam().text));
    FAIL() << "accepted: " << GetParam().text;
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), GetParam().field) << error.what();
    EXPECT_FALSE(error.problem().empty());
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

#define GAINS "com { kp: 225 kd: 10 } orientation { kp: 225 kd: 10 } foot { kp: 1 kd: 1 } "
#define UNLOAD_LEFT "transition { kind: UNLOAD foot: LEFT_FOOT delay: 0.5 duration: 0.5 } "

INSTANTIATE_TEST_SUITE_P(
    All, RefusedConfig,
    testing::Values(
        Refused{"", "com"}, Refused{"com { kp: 1 kd: 1 } phase { start: 0 }", "orientation"},
        Refused{"com { kp: -1 kd: 1 }", "com.kp"}, Refused{"com { kp: 1 }", "com.kd"},
        Refused{"com { kp: 1 kd: nan }", "com.kd"},
        Refused{"com { kp: 1 kd: 1 } orientation { kp: 1 kd: 0 }", "orientation.kd"},
        Refused{GAINS "com_lag: 0", "com_lag"}, Refused{GAINS "com_lag: nan", "com_lag"},
        Refused{GAINS "contact { touch_load: 0 }", "contact.touch_load"},
        Refused{GAINS "contact { touch_load: nan }", "contact.touch_load"},
        Refused{GAINS "contact { touch_load: 3 }", "contact.release_load"},
        Refused{GAINS "contact { release_load: 10 }", "contact.release_load"},
        Refused{GAINS "contact { release_load: -1 }", "contact.release_load"},
        Refused{GAINS "contact { press_load: 10 }", "contact.press_load"},
        Refused{GAINS "contact { press_load: inf }", "contact.press_load"},
        Refused{GAINS "contact { touch_duration: -0.1 }", "contact.touch_duration"},
        Refused{GAINS "contact { settle_duration: nan }", "contact.settle_duration"},
        Refused{GAINS "contact { search_speed: 0 }", "contact.search_speed"},
        Refused{GAINS "contact { search_depth: -0.01 }", "contact.search_depth"},
        Refused{GAINS "contact { retract_height: 0 }", "contact.retract_height"},
        Refused{GAINS "contact { expected_within: 0 }", "contact.expected_within"},
        Refused{GAINS, "phase"}, Refused{GAINS "phase { }", "phase[0].start"},
        Refused{GAINS "phase { start: 0.1 }", "phase[0].start"},
        Refused{GAINS "phase { start: 0 } phase { start: 0 }", "phase[1].start"},
        Refused{GAINS "phase { start: 0 } phase { start: 2 } phase { start: 1 }", "phase[2].start"},
        Refused{GAINS "phase { start: 0 } phase { start: inf }", "phase[1].start"},
        Refused{GAINS "phase { start: 0 support: RIGHT } phase { start: 1 support: LEFT }",
                "phase[1].support"},
        Refused{GAINS "phase { start: 0 com { duration: -1 } }", "phase[0].com.duration"},
        Refused{GAINS "phase { start: 0 com { delay: nan } }", "phase[0].com.delay"},
        Refused{GAINS "phase { start: 0 com { y: inf } }", "phase[0].com.y"},
        Refused{GAINS "phase { start: 0 support: RIGHT gravity_compensation: true } "
                      "phase { start: 1 support: DOUBLE }",
                "phase[0].gravity_compensation"},
        Refused{GAINS "phase { start: 0 gravity_compensation: true com { x: 0.1 } }",
                "phase[0].gravity_compensation"},
        Refused{GAINS "phase { start: 0 support: RIGHT foot { z: 0.1 } }", "phase[0].foot.foot"},
        Refused{GAINS "phase { start: 0 support: RIGHT foot { foot: RIGHT_FOOT } }",
                "phase[0].foot.foot"},
        Refused{GAINS "phase { start: 0 foot { foot: RIGHT_FOOT } }", "phase[0].foot.foot"},
        Refused{GAINS "phase { start: 0 support: RIGHT foot { foot: LEFT_FOOT duration: -2 } }",
                "phase[0].foot.duration"},
        Refused{"com { kp: 1 kd: 1 } orientation { kp: 1 kd: 1 } phase { start: 0 support: LEFT }",
                "foot"},
        Refused{GAINS "phase { start: 0 transition { foot: LEFT_FOOT } }",
                "phase[0].transition.kind"},
        Refused{GAINS "phase { start: 0 transition { kind: LOAD } }", "phase[0].transition.foot"},
        Refused{GAINS "phase { start: 0 " UNLOAD_LEFT "}", "phase[0].transition"},
        Refused{GAINS "phase { start: 0 " UNLOAD_LEFT "} phase { start: 2 }",
                "phase[0].transition"},
        Refused{GAINS "phase { start: 0 " UNLOAD_LEFT "} phase { start: 2 support: LEFT }",
                "phase[0].transition"},
        Refused{GAINS "phase { start: 0 " UNLOAD_LEFT "} phase { start: 0.9 support: RIGHT }",
                "phase[0].transition.duration"},
        Refused{GAINS "phase { start: 0 support: RIGHT " UNLOAD_LEFT
                      "} phase { start: 2 support: RIGHT }",
                "phase[0].transition"},
        Refused{GAINS "phase { start: 0 transition { kind: LOAD foot: LEFT_FOOT } }",
                "phase[0].transition"},
        Refused{GAINS "phase { start: 0 support: LEFT } phase { start: 1 transition { kind: LOAD "
                      "foot: LEFT_FOOT } }",
                "phase[1].transition"},
        Refused{GAINS "phase { start: 0 support: RIGHT } phase { start: 1 transition { kind: LOAD "
                      "foot: LEFT_FOOT delay: 0.3 duration: 0.8 } } phase { start: 2 }",
                "phase[1].transition.duration"},
        Refused{GAINS "phase { start: 0 transition { kind: LOAD foot: LEFT_FOOT delay: -1 } }",
                "phase[0].transition.delay"}));

EstimatedPose Pose() {
  EstimatedPose pose;
  pose.com = {0.01, 0.02, 0.7};
  pose.body_rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.sole[0].translation() = Eigen::Vector3d(0.03, -0.1, 0.001);
  pose.sole[1].translation() = Eigen::Vector3d(-0.01, 0.11, 0.002);
  return pose;
}

constexpr double kNeverWaits = 1e9;  // m, COM lag

Phase ParsePhase(const std::string& text) {
  Phase phase;
  ParseTextProto(text, "phase", &phase);
  return phase;
}

TEST(ReferenceGenerator, MovesAlongTheMinimumJerkLine) {
  ReferenceGenerator references(kNeverWaits);
  references.BeginPhase(
      ParsePhase("start: 0 com { target: OVER_RIGHT x: 0.005 z: -0.03 duration: 2 delay: 0.5 }"),
      Pose(), 0);
  const Eigen::Vector3d from = Pose().com, to(0.03 + 0.005, -0.1, 0.7 - 0.03);
  for (double t = 0; t < 3; t += 0.01) {
    const PointMotion motion = references.Update(t, Pose().com).com;
    // Flash and Hogan's polynomial.
    const double s = std::clamp((t - 0.5) / 2, 0.0, 1.0);
    const double p = 10 * std::pow(s, 3) - 15 * std::pow(s, 4) + 6 * std::pow(s, 5);
    EXPECT_LT((motion.position - from - p * (to - from)).norm(), 1e-14);
    const double v = 30 * s * s * (1 - s) * (1 - s) / 2;
    EXPECT_LT((motion.velocity - v * (to - from)).norm(), 1e-13);
    const double a = 60 * s * (1 - s) * (1 - 2 * s) / 4;
    EXPECT_LT((motion.acceleration - a * (to - from)).norm(), 1e-12);
  }
}

TEST(ReferenceGenerator, TargetsOfThePhases) {
  const Eigen::Vector3d middle(0.01, 0.005, 0.7), left(-0.01, 0.11, 0.7), com = Pose().com;
  const auto end = [](const std::string& target) {
    ReferenceGenerator references(kNeverWaits);
    references.BeginPhase(ParsePhase("start: 0 com { target: " + target + " duration: 1 }"), Pose(),
                          0);
    return references.Update(1.5, Pose().com).com.position;
  };
  EXPECT_LT((end("OVER_LEFT y: -0.02") - left - Eigen::Vector3d(0, -0.02, 0)).norm(), 1e-15);
  EXPECT_LT((end("OVER_MIDDLE") - middle).norm(), 1e-15);
  EXPECT_LT((end("SHIFT y: 0.1 z: 0.02") - com - Eigen::Vector3d(0, 0.1, 0.02)).norm(), 1e-15);
  EXPECT_LT((end("HOLD x: 3") - com).norm(), 1e-15);
}

TEST(ReferenceGenerator, PhasesJoinInPositionVelocityAndAcceleration) {
  ReferenceGenerator references(kNeverWaits);
  references.BeginPhase(ParsePhase("start: 0 com { target: SHIFT y: 0.2 duration: 2 }"), Pose(), 0);
  EstimatedPose moved = Pose();
  moved.com += Eigen::Vector3d(0.05, 0, 0);  // the estimate must not matter any more
  const PointMotion before = references.Update(0.7, Pose().com).com;
  references.BeginPhase(ParsePhase("start: 0.7 com { target: OVER_LEFT duration: 1 }"), moved, 0.7);
  const PointMotion after = references.Update(0.7, Pose().com).com;
  EXPECT_LT((after.position - before.position).norm(), 1e-14);
  EXPECT_LT((after.velocity - before.velocity).norm(), 1e-14);
  EXPECT_LT((after.acceleration - before.acceleration).norm(), 1e-12);
  EXPECT_GT(before.velocity.norm(), 0.05);
  const PointMotion end = references.Update(1.7, Pose().com).com;
  EXPECT_LT((end.position.head<2>() - moved.sole[1].translation().head<2>()).norm(), 1e-14);
  EXPECT_EQ(end.velocity.norm(), 0);
  // Velocity is the derivative of position, acceleration of velocity.
  const double h = 1e-5;
  for (double t = 0.75; t < 1.65; t += 0.05) {
    ReferenceGenerator again(kNeverWaits);
    again.BeginPhase(ParsePhase("start: 0 com { target: SHIFT y: 0.2 duration: 2 }"), Pose(), 0);
    again.Update(0.7, Pose().com);
    again.BeginPhase(ParsePhase("start: 0.7 com { target: OVER_LEFT duration: 1 }"), moved, 0.7);
    const PointMotion low = again.Update(t - h, Pose().com).com,
                      mid = again.Update(t, Pose().com).com,
                      high = again.Update(t + h, Pose().com).com;
    EXPECT_LT(((high.position - low.position) / (2 * h) - mid.velocity).norm(), 1e-8);
    EXPECT_LT(((high.velocity - low.velocity) / (2 * h) - mid.acceleration).norm(), 1e-7);
  }
}

constexpr double kLag = 0.03, kPeriod = 0.002;  // m, s

ReferenceGenerator ShiftBegun() {
  ReferenceGenerator references(kLag);
  references.BeginPhase(ParsePhase("start: 0 com { target: SHIFT y: 0.1 duration: 2 }"), Pose(), 0);
  return references;
}

TEST(ReferenceGenerator, WaitsForAComThatStandsAndEndsWhenItFollows) {
  ReferenceGenerator references = ShiftBegun();
  const Eigen::Vector3d start = Pose().com;
  double t = 0, last = 0;
  for (; t < 10; t += kPeriod) {
    const double ahead = (references.Update(t, start).com.position - start).y();
    EXPECT_GE(ahead, last);
    EXPECT_LT(ahead, kLag);
    last = ahead;
  }
  EXPECT_GT(last, 0.95 * kLag);
  EXPECT_LT(references.Update(t, start).com.velocity.norm(), 1e-3);
  EXPECT_LT(references.Update(t, start).com.acceleration.norm(), 1e-3);
  Eigen::Vector3d com = start;
  for (; t < 13; t += kPeriod) com = references.Update(t, com).com.position;
  EXPECT_LT((com - start - Eigen::Vector3d(0, 0.1, 0)).norm(), 1e-14);
}

TEST(ReferenceGenerator, SlowsDownByTheComsLag) {
  // Behind by three quarters of the lag at which it stands still: half the speed, twice the time.
  ReferenceGenerator references = ShiftBegun();
  double ended = 0;
  Eigen::Vector3d at = Pose().com;
  const Eigen::Vector3d behind(0, 0.75 * kLag, 0);
  for (double t = 0; t < 6; t += kPeriod) {
    const Eigen::Vector3d before = at;
    const PointMotion motion = references.Update(t, at - behind).com;
    at = motion.position;
    if (t > 0.5 && t < 3.5) {
      EXPECT_NEAR((at - before).y() / kPeriod, motion.velocity.y(), 2e-3);
    }
    if (motion.velocity.norm() > 0) ended = t;
  }
  EXPECT_NEAR(ended, 4, 0.08);  // the COM is behind the tick before
}

TEST(ReferenceGenerator, NeitherAComAheadNorOneBesideTheMoveSlowsItDown) {
  for (const Eigen::Vector3d& beside :
       {Eigen::Vector3d(0, 0.05, 0), Eigen::Vector3d(0.05, 0, 0.05)}) {
    ReferenceGenerator references = ShiftBegun(), on_time = ShiftBegun();
    Eigen::Vector3d at = Pose().com;
    for (double t = 0; t < 3; t += kPeriod) {
      const Eigen::Vector3d expected = on_time.Update(t, at).com.position;
      at = references.Update(t, at + beside).com.position;
      EXPECT_EQ(at, expected);
    }
  }
}

TEST(ReferenceGenerator, APhaseWithoutComReferenceLetsTheMotionEnd) {
  ReferenceGenerator references(kNeverWaits);
  references.BeginPhase(ParsePhase("start: 0 com { target: SHIFT y: 0.2 duration: 2 }"), Pose(), 0);
  references.Update(0.7, Pose().com);
  references.BeginPhase(ParsePhase("start: 0.7"), Pose(), 0.7);
  EXPECT_NEAR(references.Update(2.5, Pose().com).com.position.y(), 0.22, 1e-14);
}

TEST(ReferenceGenerator, TheFreeFootStartsWhereItIsWhenItLeavesTheGround) {
  ReferenceGenerator references(kNeverWaits);
  references.BeginPhase(ParsePhase("start: 0"), Pose(), 0);
  EstimatedPose later = Pose();
  later.sole[1].translation() = Eigen::Vector3d(0.07, 0.13, 0.004);
  later.sole[1].linear() = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  references.BeginPhase(ParsePhase("start: 1 support: RIGHT foot { foot: LEFT_FOOT x: 0.05 "
                                   "height_above_support: 0.12 duration: 2 delay: 0.1 }"),
                        later, 1);
  const References at_lift = references.Update(1.0, Pose().com);
  EXPECT_EQ(at_lift.foot[1].position, later.sole[1].translation());
  EXPECT_EQ(at_lift.foot_rotation[1], later.sole[1].linear());
  const References end = references.Update(3.2, Pose().com);
  EXPECT_LT((end.foot[1].position - Eigen::Vector3d(0.12, 0.13, 0.121)).norm(), 1e-14);
  EXPECT_EQ(end.foot_rotation[1], later.sole[1].linear());
  // A second phase in the air goes on from the reference, not from the estimate.
  references.BeginPhase(
      ParsePhase("start: 4 support: RIGHT foot { foot: LEFT_FOOT z: -0.05 duration: 1 }"), later,
      4);
  EXPECT_LT((references.Update(5, Pose().com).foot[1].position - Eigen::Vector3d(0.12, 0.13, 0.071))
                .norm(),
            1e-14);
}

TEST(ReferenceGenerator, AHeldFootRestsAndLaterMovesStartThere) {
  ReferenceGenerator references(kNeverWaits);
  references.BeginPhase(ParsePhase("start: 0 support: RIGHT foot { foot: LEFT_FOOT z: 0.1 "
                                   "duration: 1 }"),
                        Pose(), 0);
  EXPECT_NEAR(references.foot(1).target().z(), 0.102, 1e-15);
  EXPECT_NEAR(references.foot(1).end(), 1, 1e-15);
  references.Update(0.5, Pose().com);
  const Eigen::Vector3d place(0.01, 0.12, 0.07);
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).toRotationMatrix();
  references.HoldFoot(1, place, rotation);
  for (const double time : {0.5, 0.7, 2.0}) {
    const References& held = references.Update(time, Pose().com);
    EXPECT_EQ(held.foot[1].position, place);
    EXPECT_EQ(held.foot[1].velocity.norm(), 0);
    EXPECT_EQ(held.foot_rotation[1], rotation);
  }
  references.BeginPhase(ParsePhase("start: 2 support: RIGHT foot { foot: LEFT_FOOT z: 0.03 }"),
                        Pose(), 2);
  EXPECT_LT(
      (references.Update(2.1, Pose().com).foot[1].position - place - Eigen::Vector3d(0, 0, 0.03))
          .norm(),
      1e-15);
}

TEST(ReferenceGenerator, AfterGravityCompensationTheRobotHoldsWhereItWasLeft) {
  ReferenceGenerator references(kNeverWaits);
  references.BeginPhase(ParsePhase("start: 0 gravity_compensation: true"), Pose(), 0);
  EstimatedPose left = Pose();
  left.com += Eigen::Vector3d(0.02, -0.03, -0.05);
  left.body_rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
  references.BeginPhase(ParsePhase("start: 5"), left, 5);
  EXPECT_EQ(references.Update(5, Pose().com).com.position, left.com);
  EXPECT_EQ(references.Update(5, Pose().com).body_rotation, left.body_rotation);
}

}  // namespace
}  // namespace poise
