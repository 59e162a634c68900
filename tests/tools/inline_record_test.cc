// The record that an inline run keeps in memory, beside what is read of the same run's log.
#include "logging/recording/inline_record.h"

#include <gtest/gtest.h>

#include "logging/recording/inline_recorder.h"
#include "tests/logging/log_test_support.h"
#include "tools/scenario/run_setup.h"

namespace poise::logging {
namespace {

template <class T>
void ExpectSame(const Series<T>& kept, const Series<T>& read, int64_t ticks) {
  for (int64_t tick = 0; tick <= ticks; ++tick) {
    const T* const a = kept.at(tick);
    const T* const b = read.at(tick);
    ASSERT_EQ(a == nullptr, b == nullptr) << T::getTypeName() << " of tick " << tick;
    if (a != nullptr) {
      ASSERT_EQ(Encode(*a), Encode(*b)) << T::getTypeName() << " of tick " << tick;
    }
  }
}

TEST(InlineRecord, IsWhatIsReadOfTheLog) {
  RunChanges changes;
  changes.duration = 0.2;
  RunSetup setup = SetUpRun("push_double_support", changes);
  const RunSpec& spec = setup.spec;
  const TemporaryFolder folder;
  const std::string log = folder.path("run.lcm");
  RunRecord kept;
  {
    InlineRunner runner(spec, std::move(*setup.graph));
    const run_info_t info = MakeRunInfo(spec, ScenarioText(setup.loaded.scenario));
    InlineRecord record(spec, info, &runner);
    InlineRecorder recorder(log, spec, info, &runner, &record);
    runner.Run(spec.num_ticks());
    recorder.Close(spec);
    kept = record.Take(/*latencies=*/true);
  }
  const RunRecord read = ReadRun(log);

  EXPECT_EQ(Encode(kept.info), Encode(read.info));
  EXPECT_EQ(kept.spec.SerializeAsString(), read.spec.SerializeAsString());
  EXPECT_EQ(kept.robot.num_joints(), read.robot.num_joints());
  EXPECT_EQ(kept.robot.total_mass(), read.robot.total_mass());
  ASSERT_EQ(kept.num_ticks, read.num_ticks);
  EXPECT_EQ(kept.num_ticks, spec.num_ticks());
  EXPECT_EQ(kept.damages, read.damages);
  const int64_t ticks = kept.num_ticks;
  ExpectSame(kept.sensors, read.sensors, ticks);
  ExpectSame(kept.state, read.state, ticks);
  ExpectSame(kept.estimator, read.estimator, ticks);
  ExpectSame(kept.plan, read.plan, ticks);
  ExpectSame(kept.task, read.task, ticks);
  ExpectSame(kept.balance, read.balance, ticks);
  ExpectSame(kept.command, read.command, ticks);
  ExpectSame(kept.drive, read.drive, ticks);
  ExpectSame(kept.bridge, read.bridge, ticks);
  ExpectSame(kept.push, read.push, ticks);
  ExpectSame(kept.truth, read.truth, ticks);
  EXPECT_FALSE(kept.sensors.empty());
  ASSERT_EQ(kept.other.size(), read.other.size());
  EXPECT_FALSE(kept.other.empty());  // drive_feedback_t has no series of its own
  for (const auto& [channel, series] : kept.other) {
    ASSERT_TRUE(read.other.contains(channel)) << channel;
    for (int64_t tick = 0; tick <= ticks; ++tick) {
      const std::vector<uint8_t>* const a = series.at(tick);
      const std::vector<uint8_t>* const b = read.other.at(channel).at(tick);
      ASSERT_EQ(a == nullptr, b == nullptr) << channel << " of tick " << tick;
      if (a != nullptr) {
        ASSERT_EQ(*a, *b) << channel << " of tick " << tick;
      }
    }
  }
  ASSERT_EQ(kept.channels.size(), read.channels.size());
  for (size_t c = 0; c < kept.channels.size(); ++c) {
    EXPECT_EQ(kept.channels[c].name, read.channels[c].name);
    EXPECT_EQ(kept.channels[c].messages, read.channels[c].messages);
    EXPECT_EQ(kept.channels[c].missing, read.channels[c].missing);
  }
  ASSERT_EQ(kept.health.size(), read.health.size());
  for (const auto& [component, health] : kept.health) {
    ASSERT_TRUE(read.health.contains(component)) << component;
    EXPECT_EQ(Encode(health), Encode(read.health.at(component))) << component;
  }
}

}  // namespace
}  // namespace poise::logging
