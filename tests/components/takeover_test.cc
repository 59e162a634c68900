// A component's archived state is all of it: whoever takes over goes on with the same bits. Ticks
// that real time skips change no schedule.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tests/components/control_tick.h"

namespace poise {
namespace {

constexpr int kNumTicks = 685;

// From both feet to the right one, the left foot up, down, searched for, found, loaded; then no
// task, then tasks again.
std::string Phases(robot::TestRobot robot) {
  // The other robot's COM does not come above its narrow sole: it lifts the foot without a ramp.
  const char* const unload =
      robot == robot::TestRobot::kDyros
          ? "transition { kind: UNLOAD foot: LEFT_FOOT delay: 0.1 duration: 0.1 }"
          : "";
  return std::string(R"(
  hip_strategy { enabled: true }
  phase { duration: 0.25 com { target: SHIFT x: 0.01 duration: 0.2 } )") +
         unload + R"( }
  phase { duration: 0.15 support: RIGHT foot { foot: LEFT_FOOT z: 0.04 duration: 0.1 } }
  phase { duration: 0.2 support: RIGHT foot { foot: LEFT_FOOT z: -0.04 duration: 0.1 } }
  phase { duration: 0.25 com { target: SHIFT x: -0.02 duration: 0.2 delay: 0.05 }
          transition { kind: LOAD foot: LEFT_FOOT delay: 0.05 duration: 0.1 } }
  phase { duration: 0.1 gravity_compensation: true }
  phase { com { target: SHIFT y: 0.02 duration: 0.1 } }
)";
}

// N, on the left foot at a time, s: it leaves the ground, and touches while it is searched for.
double LeftLoad(double time) { return time < 0.27 ? 200 : time < 0.56 ? 0 : 30; }

// States of a robot that sways on its right foot.
std::vector<robot_state_t> States(robot::TestRobot robot) {
  ControlTick control(robot, {true, false});
  const auto sensors = SwayingSensors(control.model(), {true, false}, kNumTicks);
  std::vector<robot_state_t> states;
  for (int tick = 0; tick < kNumTicks; ++tick) {
    control.Estimate(sensors[static_cast<size_t>(tick)], TickAt(tick));
    states.push_back(control.state());
    states.back().foot_wrench[1].force[2] = -LeftLoad(TickAt(tick).time);
  }
  return states;
}

// The four components, with nothing that outlives them.
class Chain {
 public:
  explicit Chain(robot::TestRobot robot)
      : context_(robot),
        planner_(&context_, Phases(robot)),
        task_(&context_, TaskControllerText()),
        monitor_(&context_, MonitorConfig(true, 0.05, 0.05)),
        redistributor_(&context_, RedistributorText("feedback { enabled: true integral: 200 } "
                                                    "friction_compensation { share: 0.8 }")) {
    task_.Bind("support_plan", &plan());
    monitor_.Bind("support_plan", &plan());
    monitor_.Bind("task_torque", &task());
    redistributor_.Bind("support_plan", &plan());
    redistributor_.Bind("balance_torque", &balance());
  }
  void Run(const robot_state_t& state, int64_t tick) {
    planner_.Bind("robot_state", &state);
    task_.Bind("robot_state", &state);
    monitor_.Bind("robot_state", &state);
    redistributor_.Bind("robot_state", &state);
    planner_.Run(TickAt(tick));
    task_.Run(TickAt(tick));
    monitor_.Run(TickAt(tick));
    redistributor_.Run(TickAt(tick));
  }
  void TakeOver(Chain* from) {
    planner_.Restore(from->planner_.Save());
    task_.Restore(from->task_.Save());
    monitor_.Restore(from->monitor_.Save());
    redistributor_.Restore(from->redistributor_.Save());
  }
  const support_plan_t& plan() const { return planner_.output<support_plan_t>(); }
  const planner_status_t& planner() const { return planner_.output<planner_status_t>(); }
  const task_torque_t& task() const { return task_.output<task_torque_t>(); }
  const balance_torque_t& balance() const { return monitor_.output<balance_torque_t>(); }
  const joint_command_t& command() const { return redistributor_.output<joint_command_t>(); }

 private:
  ControlContext context_;
  Harness<StepPlanner> planner_;
  Harness<TaskController> task_;
  Harness<ContactWrenchMonitor> monitor_;
  Harness<Redistributor> redistributor_;
};

template <class T>
std::vector<uint8_t> Encoded(const T& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  EXPECT_GE(message.encode(bytes.data(), 0, message.getEncodedSize()), 0);
  return bytes;
}

void ExpectSame(const Chain& a, const Chain& b, int64_t tick) {
  ASSERT_EQ(Encoded(a.plan()), Encoded(b.plan())) << "tick " << tick;
  ASSERT_EQ(Encoded(a.planner()), Encoded(b.planner())) << "tick " << tick;
  ASSERT_EQ(Encoded(a.task()), Encoded(b.task())) << "tick " << tick;
  ASSERT_EQ(Encoded(a.balance()), Encoded(b.balance())) << "tick " << tick;
  ASSERT_EQ(Encoded(a.command()), Encoded(b.command())) << "tick " << tick;
}

class Takeover : public testing::TestWithParam<robot::TestRobot> {};

// Each tick is another object's, so that nothing lasts but what is archived.
TEST_P(Takeover, AFreshObjectForEveryTickGivesTheSameBits) {
  std::vector<robot_state_t> states = States(GetParam());
  // Held outputs last too.
  for (const int tick : {120, 121, 300, 450})
    states[static_cast<size_t>(tick)].base_position[0] = NAN;
  Chain whole(GetParam());
  auto reborn = std::make_unique<Chain>(GetParam());
  std::set<int> phases, foot_states, transitions;
  int balancing = 0, held = 0, answered = 0, tilted = 0;
  for (int tick = 0; tick < kNumTicks; ++tick) {
    auto next = std::make_unique<Chain>(GetParam());
    next->TakeOver(reborn.get());
    reborn = std::move(next);
    whole.Run(states[static_cast<size_t>(tick)], tick);
    reborn->Run(states[static_cast<size_t>(tick)], tick);
    ASSERT_NO_FATAL_FAILURE(ExpectSame(whole, *reborn, tick));
    phases.insert(whole.planner().phase);
    foot_states.insert(whole.planner().foot_state[1]);
    transitions.insert(whole.plan().transition);
    balancing += whole.balance().active_x + whole.balance().active_y;
    // The body sways by less; its reference is turned by more.
    tilted += Eigen::Map<const Eigen::Vector3d>(whole.task().body_orientation_error).norm() > 0.04;
    answered += ToEigen(whole.command().feedback_torque).norm() > 0.1 ? 1 : 0;
    held += whole.command().status == joint_command_t::STATUS_INVALID_INPUT ? 1 : 0;
  }
  EXPECT_EQ(phases.size(), 6u);
  EXPECT_EQ(foot_states,
            (std::set<int>{planner_status_t::FOOT_SUPPORT, planner_status_t::FOOT_SWING,
                           planner_status_t::FOOT_SEARCHING, planner_status_t::FOOT_TOUCHING}));
  EXPECT_EQ(transitions.size(), GetParam() == robot::TestRobot::kDyros ? 3u : 2u);
  EXPECT_GT(balancing, 50);
  EXPECT_EQ(held, 4);
  // The other robot is at its limits all the time, where nothing is fed back.
  if (GetParam() == robot::TestRobot::kDyros) {
    EXPECT_GT(answered, 50);
  }
  EXPECT_GT(tilted, 0);
}

TEST_P(Takeover, AnotherRobotsStateIsRefused) {
  const auto other =
      GetParam() == robot::TestRobot::kDyros ? robot::TestRobot::kMantis : robot::TestRobot::kDyros;
  ControlContext context(GetParam()), other_context(other);
  Harness<Redistributor> here(&context, RedistributorText());
  Harness<Redistributor> there(&other_context, RedistributorText());
  Redistributor fresh;
  Wiring wiring;
  context.Configure(&fresh, RedistributorText(), &wiring);
  const std::vector<uint8_t> bytes = there.Save();
  StateArchive restore = StateArchive::Restoring(bytes);
  fresh.Archive(&restore);
  EXPECT_FALSE(restore.ok());
}

// Two of three ticks are skipped, and once 40 ms of them.
TEST_P(Takeover, SkippedTicksChangeNoScheduleAndNoReference) {
  const std::vector<robot_state_t> states = States(GetParam());
  Chain whole(GetParam()), skipping(GetParam());
  std::vector<int> phase_of;
  for (int tick = 0; tick < kNumTicks; ++tick) {
    whole.Run(states[static_cast<size_t>(tick)], tick);
    phase_of.push_back(whole.planner().phase);
    if (tick % 3 != 0 || (tick > 180 && tick < 200)) continue;
    skipping.Run(states[static_cast<size_t>(tick)], tick);
    ASSERT_NE(skipping.command().status, joint_command_t::STATUS_INVALID_INPUT) << tick;
    // Measured contact, and with it double support, comes up to three ticks later.
    const int latest = phase_of.back(),
              earliest = phase_of[static_cast<size_t>(std::max(0, tick - 4))];
    ASSERT_LE(skipping.planner().phase, latest) << tick;
    ASSERT_GE(skipping.planner().phase, earliest) << tick;
    for (int i = 0; i < 3; ++i) {
      // The reference moves by 0.4 m/s at the most, and is up to three ticks late.
      ASSERT_NEAR(skipping.plan().com_reference.position[i], whole.plan().com_reference.position[i],
                  3e-3)
          << tick;
    }
  }
  EXPECT_EQ(skipping.planner().phase, 5);
}

INSTANTIATE_TEST_SUITE_P(All, Takeover,
                         testing::Values(robot::TestRobot::kDyros, robot::TestRobot::kMantis));

}  // namespace
}  // namespace poise
