#include "logging/channel_ticks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>

#include "logging/event_log_writer.h"
#include "logging/replay/component_replay.h"
#include "logging/run_record.h"
#include "logging/tick_series.h"
#include "poise/external_push_t.hpp"
#include "tests/logging/small_log.h"

namespace poise::logging {
namespace {

constexpr int64_t kFarTick = 9'999'999;

TEST(ChannelTicks, TickThatTheLogCannotHoldIsRefused) {
  RunSpec spec = SmallSpec();
  constexpr uint64_t kSize = 2900;  // 100 records of the smallest size
  ChannelTicks ticks(spec, spec.graph().channel(0), kSize);
  EXPECT_EQ(ticks.Check(Push(99)), 99);
  EXPECT_FALSE(ticks.Check(Push(100)));
  EXPECT_FALSE(ticks.Check(Push(kFarTick)));
  EXPECT_EQ(ticks.refused(), 2);

  spec.mutable_cut()->set_first_tick(1000);
  spec.mutable_cut()->set_last_tick(kFarTick);
  ChannelTicks cut(spec, spec.graph().channel(0), kSize);
  EXPECT_FALSE(cut.Check(Push(999)));
  EXPECT_EQ(cut.Check(Push(1099)), 1099);
  EXPECT_FALSE(cut.Check(Push(1100)));
}

TEST(ChannelTicks, FarTickDoesNotMakeTheRunLong) {
  const TemporaryFolder folder;
  const std::string path = folder.path("log");
  const RunSpec spec = MakeTestSpec();
  external_push_t push{};
  SetHeader(3, &push);
  std::vector<RawEvent> events = {RunInfoEvent(spec), {"EXTERNAL_PUSH", 0, Encode(push)}};
  SetHeader(kFarTick, &push);
  events.push_back({"EXTERNAL_PUSH", 0, Encode(push)});
  WriteRawLog(path, events);
  const RunRecord run = ReadRun(path);
  EXPECT_EQ(run.num_ticks, 4);
  EXPECT_NE(run.push.at(3), nullptr);
  EXPECT_EQ(run.push.at(kFarTick), nullptr);
  EXPECT_NO_THROW(LogReplay{path});
}

TEST(CheckLogSpec, TickPeriodIsBounded) {
  RunSpec spec = SmallSpec();
  for (const double period : {0.0, -1.0, 10.01, 1e300, std::nan("")}) {
    spec.set_tick_period(period);
    EXPECT_THROW(CheckLogSpec(spec, "log"), LogError) << period;
  }
  spec.set_tick_period(10);
  EXPECT_NO_THROW(CheckLogSpec(spec, "log"));
}

TEST(Series, HoldsWhatWasSetInAnyOrder) {
  Series<int64_t> series;
  EXPECT_TRUE(series.empty());
  EXPECT_EQ(series.at(0), nullptr);
  for (const int64_t tick : {50, 53, 49, 20, 0, 51}) series.Set(tick, 10 * tick);
  series.Set(53, 7);
  for (int64_t tick = -2; tick < 60; ++tick) {
    const int64_t* const item = series.at(tick);
    const bool set = tick == 0 || tick == 20 || (tick >= 49 && tick <= 51) || tick == 53;
    ASSERT_EQ(item != nullptr, set) << tick;
    if (set) {
      EXPECT_EQ(*item, tick == 53 ? 7 : 10 * tick);
    }
  }
}

}  // namespace
}  // namespace poise::logging
