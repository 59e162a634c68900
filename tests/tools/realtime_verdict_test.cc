// What a run in real time says of the machine.
#include "tools/report/realtime_verdict.h"

#include <gtest/gtest.h>

#include <string>

namespace poise {
namespace {

/// A run of a follower and the clock's owner, in this order.
RunSpec Spec() {
  RunSpec spec;
  spec.set_realtime(true);
  spec.set_tick_period(0.002);
  spec.mutable_graph()->add_component()->set_name("controller");
  ComponentInstance* const owner = spec.mutable_graph()->add_component();
  owner->set_name("bridge");
  owner->set_owns_clock(true);
  return spec;
}

RunOutcome Outcome(const health_t& follower, const health_t& owner) {
  RunOutcome outcome;
  outcome.machine = MachineLoad{};
  outcome.processes.resize(2);
  outcome.processes[0].health = follower;
  outcome.processes[1].health = owner;
  return outcome;
}

TEST(MachineVerdictTest, CountsCyclesThatBeganLateOrNever) {
  health_t follower{}, owner{};
  follower.ticks_completed = 900;
  follower.ticks_skipped = 100;
  owner.ticks_completed = 980;
  owner.deadline_misses = 5;
  owner.ticks_skipped = 20;
  owner.lateness_max = 41'000;  // us
  const MachineVerdict verdict = JudgeMachine(Spec(), Outcome(follower, owner));
  EXPECT_TRUE(verdict.known);
  EXPECT_EQ(verdict.cycles, 1000);
  EXPECT_EQ(verdict.late, 25);
  EXPECT_EQ(verdict.skipped, 100) << "of those who work, not of the clock";
  EXPECT_NEAR(verdict.latest, 0.041, 1e-12);
}

TEST(MachineVerdictTest, SaysThatNobodyReported) {
  const RunSpec spec = Spec();
  EXPECT_FALSE(JudgeMachine(spec, Outcome({}, {})).known);
  const std::string text = FormatRealtime(spec, Outcome({}, {}), {}, {});
  EXPECT_NE(text.find("machine: not known"), std::string::npos) << text;
  RunSpec lockstep = spec;
  lockstep.set_realtime(false);
  EXPECT_EQ(FormatRealtime(lockstep, Outcome({}, {}), {}, {}), "");
}

TEST(MachineVerdictTest, NamesWhoeverMayHaveMadeCommandsLate) {
  RunOutcome outcome = Outcome({}, {});
  EXPECT_EQ(CauseOfLateness(outcome), "the machine was late");
  outcome.takeovers = 7;  // somebody else's kills
  EXPECT_EQ(CauseOfLateness(outcome),
            "7 processes died or were killed, and replaced, or the machine was late");
  outcome.faults = {{.process = "a", .killed = true}, {.process = "b", .killed = false}};
  EXPECT_EQ(CauseOfLateness(outcome),
            "2 faults were injected, 6 processes died or were killed, and replaced, or the machine "
            "was late");
  outcome.takeovers = 1;
  EXPECT_EQ(CauseOfLateness(outcome), "2 faults were injected, or the machine was late");
}

TEST(MachineVerdictTest, FramesOfEmulatedDrivesAreLostByTheMachine) {
  CheckResult frames;
  frames.name = "bus_frames_lost";
  frames.passed = false;
  EXPECT_TRUE(FailedByMachine({frames}, {.emulated = true}));
  EXPECT_TRUE(FailedByMachine({frames}, {.ticks = 3, .late = 3, .emulated = true}));
  EXPECT_FALSE(FailedByMachine({frames}, {.ticks = 3, .late = 2, .emulated = true}));
  EXPECT_FALSE(FailedByMachine({frames}, {})) << "a real cable loses them, too";
  CheckResult other = frames;
  other.name = "fallen";
  EXPECT_FALSE(FailedByMachine({frames, other}, {.emulated = true}));

  logging::RunRecord run;
  run.spec = Spec();
  EXPECT_FALSE(CountLostTicks(run).emulated);
  run.spec.mutable_graph()->add_component()->set_plant(true);
  EXPECT_TRUE(CountLostTicks(run).emulated);
  run.spec.set_realtime(false);
  EXPECT_FALSE(CountLostTicks(run).emulated);
}

}  // namespace
}  // namespace poise
