#include "tools/report/wrench_difference.h"

#include <gtest/gtest.h>

#include <cmath>

namespace poise {
namespace {

// 3-4-5 in every tick, and once 12 N·m: RMS 5 N and 12 / √ticks N·m.
TEST(WrenchDifference, IsTheNormsRmsAndItsLargestWithItsTime) {
  constexpr int kTicks = 16;
  logging::RunRecord first, second;
  for (logging::RunRecord* run : {&first, &second}) {
    run->num_ticks = kTicks;
    run->spec.set_tick_period(0.002);
    robot_sensors_t message{};
    message.num_feet = 2;
    message.foot_wrench.resize(2);
    for (int64_t tick = 0; tick < kTicks; ++tick) {
      message.foot_wrench[0].force[0] = 100 + (run == &first ? 3 : 0);
      message.foot_wrench[0].force[2] = 300 + (run == &first ? 0 : 4);
      message.foot_wrench[1].moment[1] = run == &second && tick == 5 ? -12 : 0;
      run->sensors.Set(tick, message);
    }
  }
  second.spec.set_lead_ticks(0);
  const auto feet = CompareFootWrenches(first, second);
  EXPECT_DOUBLE_EQ(feet[0].force.rms, 5);
  EXPECT_DOUBLE_EQ(feet[0].force.largest, 5);
  EXPECT_EQ(feet[0].force.time, 0);
  EXPECT_EQ(feet[0].moment.rms, 0);
  EXPECT_EQ(feet[1].force.rms, 0);
  EXPECT_DOUBLE_EQ(feet[1].moment.rms, 12 / std::sqrt(kTicks));
  EXPECT_DOUBLE_EQ(feet[1].moment.largest, 12);
  EXPECT_DOUBLE_EQ(feet[1].moment.time, 0.010);
  EXPECT_EQ(feet[1].moment.ticks, kTicks);
}

// One that fell ends earlier.
TEST(WrenchDifference, IsOverTheTicksThatBothHave) {
  logging::RunRecord first, second;
  first.num_ticks = 4;
  second.num_ticks = 2;
  robot_sensors_t message{};
  message.foot_wrench.resize(2);
  for (int64_t tick = 0; tick < 4; ++tick) first.sensors.Set(tick, message);
  for (int64_t tick = 0; tick < 2; ++tick) second.sensors.Set(tick, message);
  EXPECT_EQ(CompareFootWrenches(first, second)[0].force.ticks, 2);
  second.num_ticks = 0;
  second.sensors = {};
  const auto none = CompareFootWrenches(first, second);
  EXPECT_EQ(none[0].force.ticks, 0);
  EXPECT_EQ(FormatWrenchDifferences(none), "");
}

}  // namespace
}  // namespace poise
