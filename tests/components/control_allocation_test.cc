// A control tick must not touch the heap: malloc itself is counted.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>

#include "tests/allocation_counter.h"
#include "tests/components/control_tick.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

struct Case {
  const char* name;
  const char* robot;  // Robot file, from the checkout
  const char* maker;  // its maker's file of $POISE_ROBOTS; empty: it is beside the Robot file
  Contacts in_contact;
};

void PrintTo(const Case& given, std::ostream* out) { *out << given.name; }

/// The Robot file beside its maker's; empty where that is not there.
std::filesystem::path FileOf(const Case& given) {
  namespace fs = std::filesystem;
  const fs::path own = fs::path(POISE_SOURCE_DIR) / given.robot;
  if (*given.maker == 0) return own;
  const char* const told = std::getenv("POISE_ROBOTS");
  const fs::path maker =
      (told != nullptr ? fs::path(told) : fs::path(POISE_SOURCE_DIR) / "../shared/robots") /
      given.maker;
  if (!fs::exists(maker)) return {};
  const fs::path folder = fs::path(testing::TempDir()) / ("allocation_" + std::string(given.name));
  fs::create_directories(folder);
  for (const fs::path& file : {own, maker}) {
    fs::copy_file(file, folder / file.filename(), fs::copy_options::overwrite_existing);
  }
  return folder / own.filename();
}

class ControlAllocation : public testing::TestWithParam<Case> {};

TEST_P(ControlAllocation, NoneInAThousandTicks) {
  const std::filesystem::path robot = FileOf(GetParam());
  if (robot.empty()) GTEST_SKIP() << GetParam().maker << " is not in $POISE_ROBOTS";
  ControlTick control(robot.string(), GetParam().in_contact,
                      "friction_compensation { share: 0.8 }");
  const auto sensors = SwayingSensors(control.model(), GetParam().in_contact, 1000);
  int balancing = 0;
  for (int tick = 0; tick < 1000; ++tick) {
    const long before = allocations;
    control.Run(sensors[static_cast<size_t>(tick)], TickAt(tick));
    ASSERT_EQ(allocations - before, 0) << "tick " << tick;
    ASSERT_EQ(control.task().status, task_torque_t::STATUS_OK) << "tick " << tick;
    ASSERT_NE(control.command().status, joint_command_t::STATUS_INVALID_INPUT) << "tick " << tick;
    balancing += control.balance().active_x + control.balance().active_y;
  }
  EXPECT_GT(balancing, 0) << "the null-space torque was never computed";
}

constexpr const char* kDyros = "deploy/robots/dyros/dyros_legs.pbtxt";
constexpr const char* kMantis = "tests/robot/data/mantis.pbtxt";
constexpr const char* kHeron = "deploy/robots/heron/heron.pbtxt";
constexpr const char* kTocabi = "deploy/robots/tocabi/tocabi.pbtxt";
INSTANTIATE_TEST_SUITE_P(
    All, ControlAllocation,
    testing::Values(Case{"dyros_double", kDyros, "", {true, true}},
                    Case{"dyros_right", kDyros, "", {true, false}},
                    Case{"mantis_double", kMantis, "", {true, true}},
                    Case{"mantis_right", kMantis, "", {true, false}},
                    Case{"heron_double", kHeron, "", {true, true}},
                    Case{"heron_right", kHeron, "", {true, false}},
                    Case{"tocabi_double", kTocabi, "dyros_tocabi.urdf", {true, true}},
                    Case{"tocabi_right", kTocabi, "dyros_tocabi.urdf", {true, false}}));

// Five levels of every type, as legs alone and arms meet them.
TEST(ControlAllocation, NoneWithAListOfTasks) {
  for (const robot::TestRobot robot : {robot::TestRobot::kDyros, robot::TestRobot::kMantis}) {
    const robot::RobotModel model = robot::LoadTestRobot(robot);
    ControlContext context(robot);
    Harness<TaskController> harness(
        &context, TaskControllerText() +
                      "task { type: 'com' } task { type: 'frame' foot: RIGHT }"
                      "task { type: 'frame' foot: LEFT } task { type: 'orientation' level: 1 }"
                      "task { type: 'angular_momentum' level: 2 gains { kd: 9 } }"
                      "task { type: 'frame' axis: X level: 3 gains { kp: 9 kd: 6 } }"
                      "task { type: 'joint_posture' level: 4 gains { kp: 9 kd: 6 } }");
    const robot::RobotState standing = StandingState(model);
    support_plan_t plan{};
    MessageTraits<support_plan_t>::Resize(plan, std::array{2});
    for (auto* turn : {&plan.body_reference, &plan.foot_rotation_reference[0],
                       &plan.foot_rotation_reference[1]}) {
      for (int i = 0; i < 3; ++i) turn->rotation[4 * i] = 1;
    }
    harness.Bind("support_plan", &plan);
    std::mt19937 random{TestSeed(35)};
    for (int tick = 0; tick < 200; ++tick) {
      const robot_state_t state = StateMessage(model, Disturbed(standing, 0.05, 0.5, &random));
      harness.Bind("robot_state", &state);
      plan.in_contact[0] = tick % 3 != 0 ? 1 : 0;
      plan.in_contact[1] = tick % 3 != 1 ? 1 : 0;
      plan.gravity_compensation = tick % 7 == 6 ? 1 : 0;
      const long before = allocations;
      harness.Run(TickAt(tick));
      ASSERT_EQ(allocations - before, 0) << "tick " << tick;
      ASSERT_EQ(harness.output<task_torque_t>().status, task_torque_t::STATUS_OK) << tick;
    }
  }
}

/// The stages that `planner` goes through in `ticks`, told `state_at(tick)`, while it allocates
/// nothing: the foot that should be in the air is reported where it stood, and loaded when it
/// should have come down.
template <class StateAt>
std::set<int> StagesOf(Harness<StepPlanner>* planner, int ticks, const StateAt& state_at) {
  robot_state_t state;
  planner->Bind("robot_state", &state);
  std::set<int> stages;
  for (int tick = 0; tick < ticks; ++tick) {
    state = state_at(tick);
    const double time_left = planner->output<planner_status_t>().touch_down_time;
    for (auto& wrench : state.foot_wrench) wrench.force[2] = time_left > 0 ? 0 : -100;
    const long before = allocations;
    planner->Run(TickAt(tick));
    EXPECT_EQ(allocations - before, 0) << "tick " << tick;
    stages.insert(planner->output<planner_status_t>().stepping);
  }
  return stages;
}

TEST(ControlAllocation, NoneOfAPlannerThatWalks) {
  for (const robot::TestRobot robot : {robot::TestRobot::kDyros, robot::TestRobot::kMantis}) {
    const robot::RobotModel model = robot::LoadTestRobot(robot);
    ControlContext context(robot);
    Harness<StepPlanner> harness(&context,
                                 "phase { support: DOUBLE } walk { enabled: true "
                                 "command { time: 0 vx: 0.1 wz: 0.1 } }");
    const robot_state_t standing = StateMessage(model, StandingState(model));
    const std::set<int> stages = StagesOf(&harness, 2000, [&](int) { return standing; });
    EXPECT_GE(harness.output<planner_status_t>().num_steps, 2);
    EXPECT_EQ(stages.count(planner_status_t::STEPPING_SWINGING), 1u);
    EXPECT_EQ(stages.count(planner_status_t::STEPPING_LOADING), 1u);
  }
}

// The robot goes faster and faster until it has to step.
TEST(ControlAllocation, NoneOfAPlannerThatCatchesAPush) {
  const robot::RobotModel model = robot::LoadTestRobot(robot::TestRobot::kDyros);
  ControlContext context(robot::TestRobot::kDyros);
  Harness<StepPlanner> harness(&context, "phase { support: DOUBLE } recovery { enabled: true }");
  robot::RobotState pushed = StandingState(model);
  const std::set<int> stages = StagesOf(&harness, 500, [&](int tick) {
    pushed.base_linear_velocity.x() = 0.01 * std::min(tick, 100);
    return StateMessage(model, pushed);
  });
  EXPECT_EQ(stages.count(planner_status_t::STEPPING_UNLOADING), 1u);
  EXPECT_EQ(stages.count(planner_status_t::STEPPING_SWINGING), 1u);
}

TEST(ControlAllocation, TheCounterCounts) {
  const long before = allocations;
  const ControlTick control(robot::TestRobot::kDyros, {true, true});
  EXPECT_GT(allocations - before, 100);
}

}  // namespace
}  // namespace poise
