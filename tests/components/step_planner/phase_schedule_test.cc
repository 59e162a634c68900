// Phases and transitions in time, without bus or robot.
#include "components/step_planner/phase_schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "components/framework/configuration/configuration.h"
#include "components/step_planner/planner_config.h"

namespace poise {
namespace {

constexpr std::array<bool, 2> kOverBoth{true, true};
constexpr std::array<bool, 2> kOverNeither{false, false};
constexpr std::array<bool, 2> kConfirmed{true, true};
constexpr std::array<bool, 2> kUnconfirmed{false, false};
constexpr double kTick = 0.002;

PhaseSchedule Schedule(const std::string& phases) {
  StepPlannerConfig config;
  ParseTextProto(phases, "test", &config);
  CheckStepPlannerConfig(config);
  return PhaseSchedule(config);
}

const ScheduleState& Advance(PhaseSchedule* schedule, double time,
                             const std::array<bool, 2>& can_carry_alone,
                             const std::array<bool, 2>& foot_confirmed) {
  return schedule->Advance(
      {.time = time, .can_carry_alone = can_carry_alone, .foot_confirmed = foot_confirmed});
}

// Section 7.4, then back: unload the left foot in 0.5-1.0 s, stand on the right, load it again
// from 2.0 s.
const std::string kThere =
    "phase { duration: 1 "
    "        transition { kind: UNLOAD foot: LEFT_FOOT delay: 0.5 duration: 0.5 } } "
    "phase { duration: 1 support: RIGHT } "
    "phase { transition { kind: LOAD foot: LEFT_FOOT delay: 0.2 duration: 0.4 } } ";

TEST(PhaseSchedule, FollowsTheScenarioToTheTick) {
  PhaseSchedule schedule = Schedule(kThere);
  for (int tick = 0; tick <= 1500; ++tick) {
    const double time = kTick * tick;
    const ScheduleState& state = Advance(&schedule, time, kOverBoth, kConfirmed);
    SCOPED_TRACE(time);
    const int phase = tick < 500 ? 0 : tick < 1000 ? 1 : 2;
    ASSERT_EQ(state.phase, phase);
    ASSERT_EQ(state.phase_began, tick == 0 || tick == 500 || tick == 1000);
    ASSERT_FALSE(state.waiting());
    ASSERT_EQ(schedule.next(), phase == 2 ? -1 : phase + 1);
    ASSERT_NEAR(schedule.TimeLeft(time), phase == 2 ? -1 : phase + 1 - time, 1e-9);
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
    ASSERT_EQ(state.transition_foot == robot::Foot::kLeft, kind != TransitionKind::kNone);
  }
}

// Steps end with both feet loaded: whatever share of a ramp was done, the load goes on without a
// jump from there.
TEST(PhaseSchedule, ARampThatStepsInterruptBeginsAnew) {
  PhaseSchedule schedule = Schedule(kThere);
  int tick = 0;
  for (; tick < 400; ++tick) Advance(&schedule, kTick * tick, kOverBoth, kConfirmed);
  EXPECT_NEAR(schedule.state().progress, (kTick * 399 - 0.5) / 0.5, 1e-6);
  for (; tick < 700; ++tick) {
    schedule.Hold(kTick * tick);
    ASSERT_EQ(schedule.state().transition, TransitionKind::kNone);
  }
  double last = 0;
  int phase_ticks = 0;
  for (; schedule.state().phase == 0; ++tick) {
    const ScheduleState& state = Advance(&schedule, kTick * tick, kOverBoth, kConfirmed);
    if (state.phase != 0) break;
    ASSERT_EQ(state.transition, TransitionKind::kUnloading);
    ASSERT_LE(state.progress - last, 1.001 * kTick / 0.5);
    last = state.progress;
    ASSERT_LT(++phase_ticks, 300);
  }
  EXPECT_GT(last, 1 - 1.5 * kTick / 0.5);  // the foot leaves the ground with its load gone
}

TEST(PhaseSchedule, ALoadingThatStepsInterruptIsOver) {
  PhaseSchedule schedule = Schedule(kThere);
  int tick = 0;
  for (; tick < 1150; ++tick) Advance(&schedule, kTick * tick, kOverBoth, kConfirmed);
  ASSERT_EQ(schedule.state().transition, TransitionKind::kLoading);
  for (; tick < 1200; ++tick) schedule.Hold(kTick * tick);
  for (; tick < 1300; ++tick) {
    ASSERT_EQ(Advance(&schedule, kTick * tick, kOverBoth, kConfirmed).transition,
              TransitionKind::kNone);
  }
  EXPECT_EQ(schedule.state().phase, 2);
}

TEST(PhaseSchedule, UnloadingAndAllThatFollowsWaitForTheCom) {
  PhaseSchedule schedule = Schedule(kThere);
  // The COM stands above the left foot only: the foot that is to be lifted does not count.
  const std::array<bool, 2> over_left{false, true};
  for (int tick = 0; tick < 400; ++tick) {
    const ScheduleState& state = Advance(&schedule, kTick * tick, over_left, kConfirmed);
    ASSERT_EQ(state.waiting_for, tick >= 250 ? WaitingFor::kCom : WaitingFor::kNothing) << tick;
    ASSERT_EQ(state.transition, TransitionKind::kNone);
    ASSERT_EQ(state.phase, 0);
  }
  // It arrives at tick 400: 149 waiting steps were lost, the rest of the schedule keeps its
  // distances.
  int unloading = -1, single = -1, second_double = -1;
  for (int tick = 400; tick < 1800; ++tick) {
    const ScheduleState& state = Advance(&schedule, kTick * tick, kOverBoth, kConfirmed);
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
  for (int tick = 0; tick < 400; ++tick) Advance(&schedule, kTick * tick, kOverBoth, kConfirmed);
  for (int tick = 400; tick < 600; ++tick) {
    const ScheduleState& state = Advance(&schedule, kTick * tick, kOverNeither, kConfirmed);
    ASSERT_EQ(state.phase, 0) << tick;
    ASSERT_EQ(state.waiting(), tick >= 500) << tick;
    ASSERT_EQ(state.transition, TransitionKind::kUnloading);
    if (tick >= 500) {
      ASSERT_EQ(state.progress, 1) << tick;
    }
  }
  EXPECT_EQ(Advance(&schedule, kTick * 600, kOverBoth, kConfirmed).phase, 1);
  EXPECT_FALSE(schedule.state().waiting());
  int second_double = -1;
  for (int tick = 601; tick < 1400 && second_double < 0; ++tick) {
    if (Advance(&schedule, kTick * tick, kOverNeither, kConfirmed).phase == 2) second_double = tick;
  }
  EXPECT_NEAR(second_double - 600, 500, 1);  // later phases keep their distances
}

TEST(PhaseSchedule, NeverLiftsAFootUnderTheCom) {
  PhaseSchedule schedule = Schedule(kThere);
  for (int tick = 0; tick < 10000; ++tick) {
    ASSERT_EQ(Advance(&schedule, kTick * tick, kOverNeither, kConfirmed).phase, 0);
  }
  EXPECT_TRUE(schedule.state().waiting());
}

TEST(PhaseSchedule, AnInstantUnloadingIsCheckedToo) {
  PhaseSchedule schedule = Schedule(
      "phase { duration: 1 transition { kind: UNLOAD foot: RIGHT_FOOT delay: 1 duration: 0 } } "
      "phase { support: LEFT } ");
  for (int tick = 0; tick < 1000; ++tick) {
    ASSERT_EQ(Advance(&schedule, kTick * tick, kOverNeither, kConfirmed).phase, 0);
  }
  EXPECT_EQ(Advance(&schedule, kTick * 1000, kOverBoth, kConfirmed).progress, 1);
  EXPECT_EQ(Advance(&schedule, kTick * 1001, kOverBoth, kConfirmed).phase, 1);
}

TEST(PhaseSchedule, DoubleSupportWaitsForTheFootThatComesDown) {
  PhaseSchedule schedule = Schedule(kThere);
  const std::array<bool, 2> only_right{true, false}, only_left{false, true};
  for (int tick = 0; tick < 1400; ++tick) {
    const ScheduleState& state = Advance(&schedule, kTick * tick, kOverBoth, only_right);
    ASSERT_EQ(state.phase, tick < 500 ? 0 : 1) << tick;
    ASSERT_EQ(state.waiting_for, tick < 1000 ? WaitingFor::kNothing : WaitingFor::kContact) << tick;
    ASSERT_EQ(schedule.BeforeTouchDown(), tick >= 500);
  }
  const ScheduleState& state = Advance(&schedule, kTick * 1400, kOverBoth, only_left);
  EXPECT_EQ(state.phase, 2);
  EXPECT_TRUE(state.phase_began);
  EXPECT_FALSE(state.waiting());
  // The loading keeps its distance from the phase's start: 0.2 s.
  int loading = -1;
  for (int tick = 1401; tick < 1700 && loading < 0; ++tick) {
    // A contact lost again does not end double support.
    if (Advance(&schedule, kTick * tick, kOverBoth, kUnconfirmed).progress > 0) loading = tick;
  }
  EXPECT_NEAR(loading - 1400, 100, 2);
  EXPECT_EQ(schedule.state().phase, 2);
}

TEST(PhaseSchedule, OnlyDoubleSupportAfterSingleSupportNeedsConfirmation) {
  PhaseSchedule schedule = Schedule(
      "phase { duration: 0.1 } phase { duration: 0.1 } phase { duration: 0.1 support: LEFT } "
      "phase { support: LEFT } ");
  for (int tick = 0; tick <= 150; ++tick) {
    ASSERT_FALSE(Advance(&schedule, kTick * tick, kOverBoth, kUnconfirmed).waiting());
    ASSERT_FALSE(schedule.BeforeTouchDown());
  }
  EXPECT_EQ(schedule.state().phase, 3);
}

TEST(PhaseSchedule, ContactsOfASupport) {
  EXPECT_EQ(ContactsOf(DOUBLE), (std::array<bool, 2>{true, true}));
  EXPECT_EQ(ContactsOf(RIGHT), (std::array<bool, 2>{true, false}));
  EXPECT_EQ(ContactsOf(LEFT), (std::array<bool, 2>{false, true}));
}

// Down, up again where nothing is, aside, and down there; a contact that is lost, and waiting that
// ends.
const std::string kWayOut = R"(
  phase {
    name: "down" duration: 1 support: RIGHT timeout: 0.5
    next { on: NO_SURFACE to: "aside" }
    next { on: TIMEOUT to: "give up" }
    next { on: CONTACT_LOST foot: RIGHT_FOOT to: "let go" }
  }
  phase { name: "stand" duration: 1 next { to: "down" } }
  phase { name: "aside" duration: 0.2 support: RIGHT next { to: "down" } }
  phase { name: "give up" support: RIGHT }
  phase { name: "let go" support: RIGHT gravity_compensation: true }
)";
constexpr int kDown = 0, kStand = 1, kAside = 2, kGiveUp = 3, kLetGo = 4;

TEST(PhaseOutcomes, AFootThatFindsNoSurfaceGoesElsewhereAndTriesAgain) {
  PhaseSchedule schedule = Schedule(kWayOut);
  ScheduleInput input{.can_carry_alone = kOverBoth};
  const auto run_to = [&](double time) -> const ScheduleState& {
    while (input.time < time - 1e-9) {
      input.time += kTick;
      schedule.Advance(input);
    }
    return schedule.state();
  };
  EXPECT_TRUE(schedule.Advance(input).first);
  EXPECT_EQ(run_to(1.2).waiting_for, WaitingFor::kContact);
  input.no_surface = true;
  const ScheduleState& aside = run_to(1.202);
  EXPECT_EQ(aside.phase, kAside);
  EXPECT_TRUE(aside.phase_began);
  EXPECT_FALSE(aside.first);
  EXPECT_EQ(aside.began_by, NO_SURFACE);
  EXPECT_FALSE(aside.waiting());
  input.no_surface = false;
  // Times count from what happened: 0.2 s after it began, and 1 s after that.
  EXPECT_EQ(run_to(1.400).phase, kAside);
  EXPECT_EQ(run_to(1.402).phase, kDown);
  EXPECT_EQ(schedule.state().began_by, DONE);
  input.foot_confirmed = kConfirmed;
  EXPECT_EQ(run_to(2.400).phase, kDown);
  EXPECT_EQ(run_to(2.402).phase, kStand);
  EXPECT_EQ(run_to(3.402).phase, kDown);  // round again
}

TEST(PhaseOutcomes, WaitingEndsAfterTheTimeout) {
  PhaseSchedule schedule = Schedule(kWayOut);
  int first = -1;
  for (int tick = 0; tick < 2000 && first < 0; ++tick) {
    if (Advance(&schedule, kTick * tick, kOverBoth, kUnconfirmed).phase == kGiveUp) first = tick;
  }
  EXPECT_NEAR(kTick * first, 1.5, 1.5 * kTick);
  EXPECT_EQ(schedule.state().began_by, TIMEOUT);
}

// What is waited for comes in time, again and again: each phase has its own time to wait.
TEST(PhaseOutcomes, EachPhaseWaitsForItsOwnTime) {
  PhaseSchedule schedule = Schedule(kWayOut);
  double begun = 0;
  for (int tick = 0; tick < 10000; ++tick) {
    const double time = kTick * tick;
    const bool late = time - begun > 1.3;
    const ScheduleState& state =
        Advance(&schedule, time, kOverBoth, late ? kConfirmed : kUnconfirmed);
    ASSERT_TRUE(state.phase == kDown || state.phase == kStand) << time;
    if (state.phase_began && state.phase == kDown) begun = time;
  }
}

TEST(PhaseOutcomes, OfTheFootThatIsNamed) {
  PhaseSchedule schedule = Schedule(kWayOut);
  ScheduleInput input{.can_carry_alone = kOverBoth};
  schedule.Advance(input);
  input.time = 0.1;
  input.contact_lost = {false, true};  // names no phase
  EXPECT_EQ(schedule.Advance(input).phase, kDown);
  input.time = 0.102;
  input.contact_lost = {true, false};
  input.no_surface = true;  // comes second
  EXPECT_EQ(schedule.Advance(input).phase, kLetGo);
  EXPECT_EQ(schedule.state().began_by, CONTACT_LOST);
  for (int tick = 52; tick < 1000; ++tick) {
    input.time = kTick * tick;
    ASSERT_EQ(schedule.Advance(input).phase, kLetGo);
  }
}

TEST(PhaseOutcomes, ChangeNothingWhereNoPhaseFollows) {
  PhaseSchedule schedule = Schedule(kThere);
  for (int tick = 0; tick < 1500; ++tick) {
    const ScheduleState& state = schedule.Advance({.time = kTick * tick,
                                                   .can_carry_alone = kOverBoth,
                                                   .foot_confirmed = kConfirmed,
                                                   .contact_lost = {true, true},
                                                   .no_surface = true});
    ASSERT_EQ(state.phase, tick < 500 ? 0 : tick < 1000 ? 1 : 2);
  }
}

// A run that begins before the scenario's time 0, and one that is taken up late.
TEST(PhaseSchedule, TheFirstPhaseBeginsAtTheScenariosTimeZeroOrWithTheRun) {
  for (const double start : {-1.0, 0.0, 2.5}) {
    PhaseSchedule schedule = Schedule("phase { duration: 0.5 } phase { }");
    double switched = 0;
    for (int tick = 0; tick < 1500 && switched == 0; ++tick) {
      const double time = start + kTick * tick;
      if (Advance(&schedule, time, kOverBoth, kConfirmed).phase == 1) switched = time;
    }
    EXPECT_NEAR(switched, std::max(start, 0.0) + 0.5, kTick) << start;
  }
}

TEST(PhaseSchedule, EndsEarlyWhenAskedOnceItsMovesAreOver) {
  PhaseSchedule schedule = Schedule(kThere);
  const auto run = [&](int from, int to, const std::array<bool, 2>& confirmed) {
    for (int tick = from; tick <= to; ++tick) {
      Advance(&schedule, kTick * tick, kOverBoth, confirmed);
    }
  };
  EXPECT_FALSE(schedule.EndNow(0)) << "before it has begun";
  run(0, 350, kConfirmed);
  EXPECT_FALSE(schedule.EndNow(kTick * 351)) << "the foot is being unloaded";
  run(351, 640, kConfirmed);
  ASSERT_EQ(schedule.state().phase, 1);
  EXPECT_TRUE(schedule.EndNow(kTick * 641));
  // The contact is waited for all the same.
  run(641, 700, kUnconfirmed);
  EXPECT_EQ(schedule.state().phase, 1);
  EXPECT_EQ(schedule.state().waiting_for, WaitingFor::kContact);
  run(701, 701, kConfirmed);
  EXPECT_EQ(schedule.state().phase, 2);
  EXPECT_EQ(schedule.state().began_by, DONE);
  // What follows counts from there: the ramp 0.2 s later, 0.4 s long.
  run(702, 701 + 200, kConfirmed);
  EXPECT_NEAR(schedule.state().progress, 0.5, 0.01);
  EXPECT_FALSE(schedule.EndNow(kTick * 1200)) << "nothing follows the last";
}

}  // namespace
}  // namespace poise
