// A control tick must not touch the heap: malloc itself is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>

#include "tests/components/control_tick.h"

extern "C" void* __libc_malloc(size_t size);
namespace {
std::atomic<long> allocations{0};
}
extern "C" void* malloc(size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}

namespace poise {
namespace {

struct Case {
  robot::TestRobot robot;
  Contacts in_contact;
};

class ControlAllocation : public testing::TestWithParam<Case> {};

TEST_P(ControlAllocation, NoneInAThousandTicks) {
  ControlTick control(GetParam().robot, GetParam().in_contact);
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

INSTANTIATE_TEST_SUITE_P(All, ControlAllocation,
                         testing::Values(Case{robot::TestRobot::kDyros, {true, true}},
                                         Case{robot::TestRobot::kDyros, {true, false}},
                                         Case{robot::TestRobot::kMantis, {true, true}},
                                         Case{robot::TestRobot::kMantis, {true, false}}));

TEST(ControlAllocation, TheCounterCounts) {
  const long before = allocations;
  const ControlTick control(robot::TestRobot::kDyros, {true, true});
  EXPECT_GT(allocations - before, 100);
}

}  // namespace
}  // namespace poise
